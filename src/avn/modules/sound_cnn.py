"""Sound network: estimates the location of a source relative to the agent from one clip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torchmetrics import MeanSquaredError, Metric

from avn.core.errors import UserError
from avn.modules.audio_network import AudioNetwork, PictureBatch
from avn.modules.network import SUBSETS
from avn.modules.sound_metrics import LocationErrors


class SoundCnn(AudioNetwork):
    """Network that regresses the relative location of a clip's source.

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
        self.training_loss: Metric = MeanSquaredError()
        # In plain lists metrics stay on the CPU and out of checkpoints.
        self.losses: list[Metric] = [MeanSquaredError() for _ in SUBSETS]
        self.errors: list[LocationErrors] = []

    def forward(self, clips: Tensor) -> Tensor:
        """Estimate the source locations of N clips.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor
            Waveforms of the left and the right ear.

        Returns
        -------
        (N, 2) float32 tensor
            Metres to the right and to the front.
        """
        return self.location(super().forward(clips))

    def features(self, clips: Tensor) -> Tensor:
        """Return audio embeddings: the last hidden layer and the estimated location.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor
            Waveforms of the left and the right ear.

        Returns
        -------
        (N, 2 * hidden + 2) float32 tensor
            Hidden layer of the clip, hidden layer of its mirror image, and location in metres as
            `forward` gives it with `flip_tta`.

        Raises
        ------
        UserError
            Where `net` has no hidden layer, methods `hidden` and `answer`.
        """
        net: Any = self.net
        if not (hasattr(net, "hidden") and hasattr(net, "answer")):
            raise UserError(f"sound_model.net: {type(net).__name__} gives no features")
        pictures = self.pictures(clips)
        both = torch.cat((pictures, self.spectrogram.mirror(pictures)))
        hidden = net.hidden(both.contiguous(memory_format=torch.channels_last))
        straight, mirrored = net.answer(hidden).chunk(2)
        outputs = (straight + self.mirror_outputs(mirrored)) / 2
        return torch.cat((*hidden.chunk(2), self.location(outputs)), dim=1)

    def location(self, outputs: Tensor) -> Tensor:
        """Return the locations (N, 2) of outputs of the last layer, which are locations here."""
        return outputs

    def name_sounds(self, sounds: Sequence[str]) -> None:
        """Set the names of the sounds, by index; metrics are grouped by them."""
        self.errors = [LocationErrors(sounds) for _ in SUBSETS]

    def training_step(self, batch: PictureBatch, index: int) -> Tensor:
        """Return the mean squared error in square metres, after flip augmentation."""
        pictures, target = self.random_flip(batch["pictures"], batch["target"])
        estimate = self._net(pictures)
        loss = nn.functional.mse_loss(estimate, target)
        self.training_loss(estimate.detach().flatten(), target.flatten())
        return loss

    def on_train_epoch_end(self) -> None:
        """Log the mean training loss of the epoch (with dropout and augmentation)."""
        self.log("loss/steps", self.training_loss.compute() * 1.0)
        self.training_loss.reset()

    def validation_step(self, batch: PictureBatch, index: int, dataloader_idx: int = 0) -> None:
        """Add one batch to the metrics of a subset.

        Parameters
        ----------
        batch : PictureBatch
            Spectrograms with locations in metres.
        index : int
            Number of the batch; unused.
        dataloader_idx : int
            Index into `SUBSETS`.
        """
        estimate, target = self.estimate(batch["pictures"]).cpu(), batch["target"].cpu()
        self.losses[dataloader_idx].update(estimate.flatten(), target.flatten())
        in_sight, sound = batch["in_sight"].cpu(), batch["sound"].cpu()
        self.errors[dataloader_idx].update(estimate, target, in_sight, sound)

    def on_validation_epoch_end(self) -> None:
        """Log losses and median errors, such as `error_m/validation/in_sight/ring`."""
        for subset, loss, errors in zip(SUBSETS, self.losses, self.errors, strict=True):
            values = {f"loss/{subset}": loss.compute()}
            for name, value in errors.compute().items():
                kind, group = name.split("/", 1)
                values[f"{kind}/{subset}/{group}"] = value
            loss.reset()
            errors.reset()
            self.keep(values)
