"""Mixes that sound the same are equal once clipped."""

import torch

from avn.core.sound_mix import SoundMix


def mix(begin, end):
    ends = torch.tensor([begin, end], dtype=torch.float64)
    return SoundMix.steady(len(begin))._replace(begin=ends[0], end=ends[1])


def test_beginnings_long_ago_and_silence_are_all_alike():
    found = mix([-9.0, -1.0, -5.0, 2.0, 0.2], [7.0, 3.0, -4.0, 9.0, 0.6]).clipped(1.0)
    assert found.begin.tolist() == [-1.0, -1.0, 0.0, 0.0, 0.2]
    assert found.end.tolist() == [1.0, 1.0, 0.0, 0.0, 0.6]


def test_the_steady_sound_has_always_sounded():
    found = SoundMix.steady(2).clipped(3.0)
    assert found.begin.tolist() == [-3.0, -3.0]
    assert found.end.tolist() == [1.0, 1.0]
    assert (found.other_source == -1).all()
