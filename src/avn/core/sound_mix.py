"""Mix of a second of sound: when and where its source sounds, and a second source."""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor


class SoundMix(NamedTuple):
    """Part of a second in which the source of N agents sounds, its place, and a second source.

    Attributes
    ----------
    begin, end : (N,) float64 tensor
        Seconds, relative to the beginning of the second, between which the source emits sound; a
        source that has always sounded began at minus infinity.
    other_source, other_sound : (N,) int64 tensor
        Index of a second source that sounds all the time, and of its recording; -1 for none.
    place, place_before : (N,) int64 tensor
        Index of the place of a moving source among the responses of the apartment, in this second
        and in the one before; -1 for its own place.
    """

    begin: Tensor
    end: Tensor
    other_source: Tensor
    other_sound: Tensor
    place: Tensor
    place_before: Tensor

    @classmethod
    def steady(cls, n: int) -> SoundMix:
        """Return the mix of N agents whose only source sounds all the time."""
        ends = torch.full((2, n), math.inf, dtype=torch.float64)
        return cls(-ends[0], ends[1], *torch.full((4, n), -1))

    def clipped(self, memory: float) -> SoundMix:
        """Return the mix that sounds the same, with the least different beginnings and ends.

        Parameters
        ----------
        memory : float
            Seconds after which a sound has decayed.
        """
        begin, end = self.begin.clamp(-memory, 1.0), self.end.clamp(-memory, 1.0)
        silent = begin >= end
        return self._replace(begin=begin.masked_fill(silent, 0.0), end=end.masked_fill(silent, 0.0))

    def rows(self, rows: Tensor) -> SoundMix:
        """Return the mix of some agents."""
        return SoundMix(*(part[rows] for part in self))
