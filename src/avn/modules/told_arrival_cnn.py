"""Sound network with heads that is told the category of the sound to listen to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn

from avn.core.errors import UserError
from avn.modules.arrival_cnn import ArrivalCnn
from avn.modules.audio_network import PictureBatch
from avn.modules.category_mask import FRAMES, CategoryMask

# Smallest factor on the power of a band, of which the logarithm is taken.
_LEAST = 1e-3


class ToldArrivalCnn(ArrivalCnn):
    """Network that estimates how the sound of one category arrives, among other sounds.

    A first network finds the parts of the spectrogram that belong to the category; power and
    interaural coherence of the rest are damped before the second network, that of `ArrivalCnn`. The
    first learns from the share that the sound has in the power of each band and frame, by
    cross-entropy, which is added to the losses of the heads.

    Parameters
    ----------
    categories : sequence of str
        Categories that it can be told, one or more.
    mixtures : float
        Share of the training clips with a second source, of another category, 0 to 1; read by the
        data module.
    mask_weight : float
        Factor on the loss of the first network, 0 or more.
    **recipe
        Those of `ArrivalCnn`.

    Raises
    ------
    UserError
        If there are no categories, a factor is out of range, or the frames of the spectrogram are
        no multiple of 16.
    """

    # the mask itself
    further_channels = 1

    def __init__(
        self,
        categories: Sequence[str] = (),
        mixtures: float = 0.8,
        mask_weight: float = 2.0,
        **recipe: Any,
    ) -> None:
        if not categories:
            raise UserError("sound_model.categories: empty; give those that it is told")
        if not 0 <= mixtures <= 1:
            raise UserError(f"sound_model.mixtures: {mixtures}; give a share, 0 to 1")
        if not mask_weight >= 0:
            raise UserError(f"sound_model.mask_weight: {mask_weight}; give 0 or more")
        super().__init__(**recipe)
        self.mask_weight = mask_weight
        if self.spectrogram.frames % (2 * FRAMES):
            raise UserError(
                f"sound_model.spectrogram.frames: {self.spectrogram.frames}; give a multiple of "
                f"{2 * FRAMES}"
            )
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(self.hparams["train_seed"])
            self.mask = CategoryMask(len(categories), self.spectrogram.bands)

    def pictures(self, clips: Tensor, told: Tensor | None = None) -> Tensor:
        """Return the network's input for N clips; see `arrival`."""
        if told is None:
            told = torch.zeros(len(clips), dtype=torch.int64, device=clips.device)
        return self._masked(self.spectrogram(clips), told)[0]

    def arrival(self, clips: Tensor, told: Tensor | None = None) -> Tensor:
        """Estimate how the sound of N clips arrives.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor
            Waveforms of the left and the right ear.
        told : (N,) int64 tensor, optional
            Number of the category to listen to in `categories`, from 1, and 0 where it is not told;
            not told by default.

        Returns
        -------
        (N, bins + 6) float32 tensor
            See `Arrivals`.
        """
        return self.answer(self.estimate(self.pictures(clips, told)))

    def input_of(self, batch: PictureBatch) -> Tensor:
        """Return the network's input for a batch: masked spectrograms and the mask."""
        return self._masked(batch["pictures"], batch["told"])[0]

    def training_step(self, batch: PictureBatch, index: int) -> Tensor:
        """Return the loss, after flip augmentation."""
        pictures, odds = self._masked(batch["pictures"], batch["told"])
        pictures, target = self.random_flip(pictures, batch["target"])
        loss = self.loss(self._net(pictures), target, batch["in_sight"])
        self.training_loss.update(loss.detach(), len(target))
        told = batch["told"] > 0
        if not told.any():
            return loss
        mask = nn.functional.binary_cross_entropy_with_logits(odds[told], batch["mask"][told])
        return loss + self.mask_weight * mask

    def _masked(self, pictures: Tensor, told: Tensor) -> tuple[Tensor, Tensor]:
        """Return the input of the second network and the log-odds of the first."""
        odds = self.mask(pictures[:, :2], told)
        mask = torch.where((told > 0)[:, None, None], odds.sigmoid(), 1.0)[:, None]
        mask = mask.repeat_interleave(pictures.shape[-1] // FRAMES, dim=-1)
        power = pictures[:, :2] + torch.log10(mask.clamp_min(_LEAST))
        return torch.cat((power, pictures[:, 2:] * mask, mask), 1), odds
