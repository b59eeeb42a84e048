"""The order in which a listening network hears its training clips."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import torch
from torch.utils.data import Sampler

if TYPE_CHECKING:
    from avn.datamodules.sound import ClipSet


class FreshTakes(Sampler[int]):
    """The items of a training epoch in a random order: every pair, each time in another take.

    The order is drawn from the seed and the epoch alone, so that a resumed training sees what
    an uninterrupted one would have seen.

    Parameters
    ----------
    clips : ClipSet
    seed : int
    sounds_per_pair : int
        How many of the sounds a pair is heard with in one epoch.
    """

    def __init__(self, clips: ClipSet, seed: int, sounds_per_pair: int) -> None:
        self.clips, self.seed, self.sounds_per_pair = clips, seed, sounds_per_pair
        self.epoch = 0

    def set_epoch(self, epoch: int) -> None:
        """Called by the trainer before each epoch."""
        self.epoch = epoch

    def __len__(self) -> int:
        return self.clips.pairs * self.sounds_per_pair

    def __iter__(self) -> Iterator[int]:
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        sounds = len(self.clips.sounds.names)
        ranks = torch.rand(self.clips.pairs, sounds, generator=generator).argsort(1)
        chosen = ranks[:, : self.sounds_per_pair].flatten()
        pairs = torch.arange(self.clips.pairs).repeat_interleave(self.sounds_per_pair)
        items = self.clips.item(pairs, chosen, self.epoch)
        yield from items[torch.randperm(len(items), generator=generator)].tolist()
