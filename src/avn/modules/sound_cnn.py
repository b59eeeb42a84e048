"""The sound network: where a sound comes from, in metres to the right and to the front."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import torch
from omegaconf import MISSING
from torch import Tensor, nn
from torchmetrics import MeanSquaredError

from avn.core.errors import UserError
from avn.modules.five_layer_cnn import FiveLayerCnn, NetConfig
from avn.modules.listener import Listener, PictureBatch
from avn.modules.network import SPLITS, OptimizerConfig
from avn.modules.sound_metrics import LocationErrors
from avn.modules.spectrogram import SpectrogramConfig


@dataclass
class SoundModelConfig:
    """What hears, with the recipe that trains it: one node of the config, `sound_model`."""

    _target_: str = "avn.modules.sound_cnn.SoundCnn"
    # The parts arrive as plain dicts: a checkpoint can hold them, and `weights_only=True` reads it.
    _recursive_: bool = False
    _convert_: str = "all"
    name: str = MISSING
    spectrogram: SpectrogramConfig = field(default_factory=SpectrogramConfig)
    net: NetConfig = field(default_factory=NetConfig)
    optimizer: OptimizerConfig = field(default_factory=OptimizerConfig)
    schedule: str = "cosine"
    epochs: int = 15
    patience: int = 6
    batch: int = 64
    mirror: bool = True
    symmetric: bool = True
    train_seed: int = 0
    sounds_per_pair: int = 1
    validation_clips: int = 2000


def no_sound_model(**_: Any) -> None:
    """What the option `none` of the group builds: nothing, so that no agent hears."""


class SoundCnn(Listener):
    """Spectrogram, network and the recipe that trains them.

    Parameters
    ----------
    name : str
        The option of the config group.
    spectrogram, net, optimizer : dict
        Configs with `_target_`, as plain dicts.
    schedule : {"cosine", "constant"}
        Learning rate over the epochs; "cosine" warms up over the first tenth and falls to 0.
    epochs, patience : int
        Length of the training, and after how many epochs without progress it stops early.
    mirror : bool
        Shows half of the training clips with ears and locations mirrored, which is exact: the
        head is symmetric and so is the world.
    symmetric : bool
        Estimates as the mean over a clip and its mirror image, mirrored back.
    train_seed : int
        Draws the weights and all that is random in training.
    batch, sounds_per_pair, validation_clips : int
        Read by the data module; kept here so that the checkpoint knows its whole recipe.
    """

    node = "sound_model"
    what = "sound network"
    # Median over all validation clips.
    monitor = "error_m/validation/all/all"
    # A source on the right is on the left once the ears are exchanged.
    mirror_signs = (-1.0, 1.0)

    def __init__(
        self,
        name: str,
        spectrogram: dict[str, Any],
        net: dict[str, Any],
        optimizer: dict[str, Any],
        schedule: str = "cosine",
        epochs: int = 15,
        patience: int = 6,
        batch: int = 64,
        mirror: bool = True,
        symmetric: bool = True,
        train_seed: int = 0,
        sounds_per_pair: int = 1,
        validation_clips: int = 2000,
    ) -> None:
        super().__init__()
        self.save_hyperparameters()
        self.build_ears()
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
        pictures, target = self.half_mirrored(batch["pictures"], batch["target"])
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
