"""Names of sounds that are given as files: distinct, and never those of built-in sounds."""

import pytest

from avn.acoustics.sound_names import joined_names, name_sounds
from avn.acoustics.sound_table import select
from avn.core.errors import UserError


def names(*paths, **given):
    return list(name_sounds({**given, **{path: path for path in paths}}))


@pytest.mark.parametrize(
    ("paths", "expected"),
    [
        (["x/phone.wav"], ["phone"]),
        (["my.tone.wav", "/a/bell.ogg"], ["my.tone", "bell"]),
        (["a/phone.wav", "b/phone.wav"], ["a-phone", "b-phone"]),
        (["a/phone.wav", "a/phone.flac", "x.wav"], ["phone.wav", "phone.flac", "x"]),
        (["./ring.wav"], ["ring.wav"]),
        (["x/ring.wav"], ["x-ring"]),
        (["ring", "ring.wav"], ["ring", "ring.wav"]),
        (["all.wav", "alarm"], ["all.wav", "alarm"]),
    ],
)
def test_files_are_named_by_their_stems_unless_these_are_taken(paths, expected):
    assert names(*paths) == expected
    named = name_sounds({path: path for path in paths})
    assert list(named.values()) == paths
    assert name_sounds(named) == named  # a saved config is read again


def test_given_names_stay_and_are_not_taken_by_files():
    assert names("a/bell.wav", bell="b.wav", ring="mine.wav") == ["bell", "ring", "a-bell"]


@pytest.mark.parametrize("paths", [["a/x/b.wav", "c/x/b.wav"], ["./b.wav", "b.wav"]])
def test_files_that_cannot_be_told_apart_are_refused(paths):
    with pytest.raises(UserError, match=r"sound: .* and .* cannot be told apart") as caught:
        names(*paths)
    assert all(path in str(caught.value) for path in paths)


def test_joined_names_of_many_sounds_are_their_number():
    assert joined_names(["ring", "alarm", "clock"], "-") == "ring-alarm-clock"
    names = select(split=["test"])
    assert joined_names(names) == f"{len(names)}-sounds"
    assert len(joined_names(["é" * 60] * 2).encode()) < 200
