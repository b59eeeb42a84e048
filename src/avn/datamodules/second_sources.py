"""Second sources of training clips, and what a network is told of the first ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from avn.core.errors import UserError
from avn.core.random import derive, scramble, uniform
from avn.core.second_source import draw_second_source
from avn.modules.category_mask import FRAMES
from avn.modules.spectrogram import POWER_FLOOR, TOGETHER, Spectrogram

# Share of the clips with one source in which its category is told all the same.
_TOLD_ALONE = 0.3


class SecondSources:
    """Draw of a second source for a share of clips, whose goal's category is then told.

    The second source is at another source's place, as loud as the first one, and its sound is of
    another category. Where there is none, the category is told in three of ten clips, so that a
    network hears both. Sounds of categories that cannot be told have no second source.

    Parameters
    ----------
    share : float
        Share of the clips with a second source, 0 to 1.
    known : sequence of str
        Categories that can be told.
    categories : sequence of str
        Category of each sound.
    purpose : str
        Use of the clips; different uses have independent draws.
    seed : int
        Seed of the draws.
    spectrogram : Spectrogram
        Its bands are those of the masks.

    Raises
    ------
    UserError
        If there are second sources, but no sounds of two categories, one of them known.
    """

    def __init__(
        self,
        share: float,
        known: Sequence[str],
        categories: Sequence[str],
        purpose: str,
        seed: int,
        spectrogram: Spectrogram,
    ) -> None:
        if share and (len({*categories}) < 2 or not {*categories} & {*known}):
            raise UserError(
                "sound_model.mixtures: the sounds of the training world are of one category, or of "
                "none of sound_model.categories; give training.sounds=heard, or mixtures=0"
            )
        self.spectrogram = spectrogram
        self.share, self.categories = share, tuple(categories)
        self.told = torch.tensor(
            [known.index(name) + 1 if name in known else 0 for name in categories]
        )
        self._key = derive("second source", purpose, seed)

    def mask(self, first: Tensor, second: Tensor) -> Tensor:
        """Return the share of the first sources in the power of each band and frame.

        Parameters
        ----------
        first, second : (N, 2, rate) float32 tensor
            Sound of both at the ears; 0 where there is no second source.

        Returns
        -------
        (N, bands, FRAMES) float32 tensor
            See `CategoryMask`.
        """
        found = torch.ones(len(first), self.spectrogram.bands, FRAMES)
        for rows in second.abs().amax((1, 2)).nonzero()[:, 0].split(TOGETHER):
            # every second of the frames that are pooled is enough
            own, other = (
                self.spectrogram.power(part[rows], 2 * FRAMES).sum(1) for part in (first, second)
            )
            share = own / (own + other).clamp_min(POWER_FLOOR)
            found[rows] = share.unflatten(-1, (FRAMES, 2)).mean(-1)
        return found

    def draw(
        self, item: Tensor, source: Tensor, sound: Tensor, sources: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Draw for N clips.

        Parameters
        ----------
        item : (N,) int64 tensor
            Identity of the clips.
        source, sound : (N,) int64 tensor
            Their sources and sounds.
        sources : (N,) int64 tensor
            Number of sources of their apartments.

        Returns
        -------
        told, other_source, other_sound : (N,) int64 tensor
            Category that is told, from 1, and 0 for none; the second source, and -1 for none.
        """
        keys = scramble(self._key, item.numpy())
        told = self.told[sound]
        mixed = torch.from_numpy(uniform(keys, 2) < self.share) & (told > 0) & (sources > 1)
        named = mixed | torch.from_numpy(uniform(keys, 3) < _TOLD_ALONE)
        other_source = other_sound = torch.full_like(told, -1)
        if mixed.any():
            other = draw_second_source(
                keys, source.numpy(), sound.numpy(), np.maximum(sources.numpy(), 2), self.categories
            )
            other_source, other_sound = (torch.where(mixed, part, -1) for part in other)
        return torch.where(named, told, 0), other_source, other_sound
