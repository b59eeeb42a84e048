"""Options of the group `sound`: selections of the package's recordings, and their names."""

import pytest

from avn.acoustics.sound_table import select
from avn.config.python import compose_command


def sounds(option):
    return list(compose_command("eval", ["agent=greedy", f"sound={option}"])[0].sound)


@pytest.mark.parametrize(
    ("option", "selected"),
    [
        ("telephone", select(["telephone"], ["test"])),
        ("alarms", select(["alarm"], ["test"])),
        ("all_train", select(split=["train"])),
        ("all_validation", select(split=["validation"])),
        ("all_test", select(split=["test"])),
        ("heard", select(split=["train"], category_split=["train"])),
        ("unheard", select(split=["test"], category_split=["train"])),
        ("unheard_category", select(split=["test"], category_split=["test"])),
        ("ring", ["ring"]),
        ("alarm", ["alarm"]),
        ("clock", ["clock"]),
        ("all", ["ring", "alarm", "clock"]),
        ("dog_pair", ["dog_pair"]),
        ("[ring,dog]", ["ring", *select(["dog"], ["test"])]),
        ("[dog_pair,ring]", ["dog_pair", "ring"]),
    ],
)
def test_an_option_is_its_selection(option, selected):
    assert sounds(option) == selected
