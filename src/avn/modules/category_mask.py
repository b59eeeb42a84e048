"""Network that finds the parts of a spectrogram which belong to a sound of one category."""

from __future__ import annotations

import torch
from torch import Tensor, nn

# Frames of a mask: categories differ more over frequency than over time.
FRAMES = 8
_WIDTH = 16
_BLOCKS = 3


class CategoryMask(nn.Module):
    """Convolutions on the power of both ears whose features the category scales and shifts.

    Scale and shift of each feature are learnt for each category (Perez et al., "FiLM: visual
    reasoning with a general conditioning layer", AAAI 2018).

    Parameters
    ----------
    categories, bands : int
        Number of categories and of bands.
    """

    place: Tensor

    def __init__(self, categories: int, bands: int) -> None:
        super().__init__()
        # where the band is, as a sound's place on the frequency axis matters
        place = torch.linspace(-1, 1, bands)[None, None, :, None]
        self.register_buffer("place", place, persistent=False)
        self.convolutions = nn.ModuleList(
            nn.Conv2d(2 if block == 0 else _WIDTH, _WIDTH, (5, 3), padding=(2, 1))
            for block in range(_BLOCKS)
        )
        self.norms = nn.ModuleList(nn.BatchNorm2d(_WIDTH, affine=False) for _ in range(_BLOCKS))
        self.around = nn.ModuleList(nn.Linear(_WIDTH, _WIDTH) for _ in range(_BLOCKS))
        self.told = nn.Embedding(categories + 1, 2 * _BLOCKS * _WIDTH)
        nn.init.normal_(self.told.weight, std=0.1)
        self.last = nn.Conv2d(_WIDTH, 1, 1)

    def forward(self, power: Tensor, told: Tensor) -> Tensor:
        """Return the log-odds of each band and frame to belong to the sound of a category.

        Parameters
        ----------
        power : (N, 2, bands, frames) tensor
            Logarithm of the power of both ears; frames are a multiple of `FRAMES`.
        told : (N,) int64 tensor
            Category, from 1.

        Returns
        -------
        (N, bands, FRAMES) tensor
        """
        x = power.mean(1, keepdim=True).unflatten(-1, (FRAMES, -1)).mean(-1)
        x = x - x.mean((1, 2, 3), keepdim=True)
        x = torch.cat((x, self.place.expand(len(x), -1, -1, x.shape[-1])), 1)
        factors = self.told(told).unflatten(1, (_BLOCKS, 2, _WIDTH, 1, 1))
        layers = zip(self.convolutions, self.norms, self.around, strict=True)
        for block, (convolution, norm, around) in enumerate(layers):
            scale, shift = factors[:, block].unbind(1)
            found = norm(convolution(x))
            # what the whole second sounds like
            found = found + around(found.relu().mean((2, 3)))[..., None, None]
            found = torch.relu(found * (1 + scale) + shift)
            x = found if block == 0 else x + found
        odds: Tensor = self.last(x)[:, 0]
        return odds
