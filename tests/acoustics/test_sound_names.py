"""Names of sounds that are given as files: distinct, and never those of built-in sounds."""

import pytest

from avn.acoustics.sound_names import name_sounds
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
