"""Folder of runs that is named by sounds."""

from avn.acoustics.sound_table import select
from avn.pipeline.sounds import folder_of_sounds


def test_a_folder_has_the_names_of_few_sounds_and_the_number_of_many():
    assert folder_of_sounds(["ring", "alarm", "clock"]) == "ring-alarm-clock"
    names = select(split=["test"])
    assert folder_of_sounds(names) == f"{len(names)}-sounds"
    assert len(folder_of_sounds(["é" * 60] * 2).encode()) < 255
