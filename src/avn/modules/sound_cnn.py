"""The sound network: where a sound comes from, in metres to the right and to the front."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torchmetrics import MeanSquaredError

from avn.core.errors import UserError
from avn.modules.audio_network import AudioNetwork, PictureBatch
from avn.modules.five_layer_cnn import FiveLayerCnn
from avn.modules.network import SPLITS
from avn.modules.sound_metrics import LocationErrors


class SoundCnn(AudioNetwork):
    """Sound network: estimates where the source of a clip is.

    Parameters
    ----------
    **recipe
        Those of `AudioNetwork`.
    """

    node = "sound_model"
    what = "sound network"
    # Median over all validation clips.
    monitor = "error_m/validation/all/all"
    # A source on the right is on the left once the ears are exchanged.
    mirror_signs = (-1.0, 1.0)

    def __init__(self, **recipe: Any) -> None:
        super().__init__(**recipe)
        self.training_loss = MeanSquaredError()
        # Plain lists: they take what is already on the CPU and are no part of a checkpoint.
        self.losses = [MeanSquaredError() for _ in SPLITS]
        self.errors: list[LocationErrors] = []

    def forward(self, clips: Tensor) -> Tensor:
        """Hear N clips.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor

        Returns
        -------
        (N, 2) float32 tensor
            Metres to the right and to the front.
        """
        return super().forward(clips)

    def features(self, clips: Tensor) -> Tensor:
        """What other networks learn from: the last hidden layer, and what the network says.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor

        Returns
        -------
        (N, 2 * hidden + 2) float32 tensor
            The hidden layer for the clip and for its mirror image, and the location in metres as
            `forward` gives it for a network that is `symmetric`.

        Raises
        ------
        UserError
            Where the recipe's network is no `FiveLayerCnn`.
        """
        if not isinstance(self.net, FiveLayerCnn):
            raise UserError(f"sound_model.net: {type(self.net).__name__} gives no features")
        pictures = self.spectrogram(clips)
        both = torch.cat((pictures, self.spectrogram.mirror(pictures)))
        hidden = self.net.hidden(both.contiguous(memory_format=torch.channels_last))
        straight, mirrored = self.net.answer(hidden).chunk(2)
        location = (straight + mirrored * mirrored.new_tensor(self.mirror_signs)) / 2
        return torch.cat((*hidden.chunk(2), location), dim=1)

    def name_sounds(self, sounds: Sequence[str]) -> None:
        """Say what the sounds of the batches are called; the metrics are by these names."""
        self.errors = [LocationErrors(sounds) for _ in SPLITS]

    def training_step(self, batch: PictureBatch, index: int) -> Tensor:
        """The mean square error in square metres, with half of the clips mirrored."""
        pictures, target = self.random_flip(batch["pictures"], batch["target"])
        estimate = self._net(pictures)
        loss = nn.functional.mse_loss(estimate, target)
        self.training_loss(estimate.detach().flatten(), target.flatten())
        return loss

    def on_train_epoch_end(self) -> None:
        """Log the loss that the epoch's steps saw (with dropout, on fresh clips)."""
        self.log("loss/steps", self.training_loss.compute() * 1.0)
        self.training_loss.reset()

    def validation_step(self, batch: PictureBatch, index: int, dataloader_idx: int = 0) -> None:
        """Take in the errors of one batch of one of `SPLITS`."""
        estimate, target = self.estimate(batch["pictures"]).cpu(), batch["target"].cpu()
        self.losses[dataloader_idx].update(estimate.flatten(), target.flatten())
        in_sight, sound = batch["in_sight"].cpu(), batch["sound"].cpu()
        self.errors[dataloader_idx].update(estimate, target, in_sight, sound)

    def on_validation_epoch_end(self) -> None:
        """Log losses and medians, such as `error_m/validation/in_sight/ring`."""
        for split, loss, errors in zip(SPLITS, self.losses, self.errors, strict=True):
            values = {f"loss/{split}": loss.compute()}
            for name, value in errors.compute().items():
                kind, group = name.split("/", 1)
                values[f"{kind}/{split}/{group}"] = value
            loss.reset()
            errors.reset()
            self.keep(values)
