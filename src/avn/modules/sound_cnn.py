"""The sound network: where a sound comes from, in metres to the right and to the front."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypedDict

import lightning as L
import torch
from hydra.errors import InstantiationException
from hydra.utils import instantiate
from lightning.pytorch.utilities.types import OptimizerLRSchedulerConfig
from omegaconf import MISSING
from torch import Tensor, nn
from torch.optim.lr_scheduler import LambdaLR
from torchmetrics import MeanSquaredError

from avn.errors import UserError
from avn.modules.five_layer_cnn import NetConfig
from avn.modules.sound_metrics import LocationErrors
from avn.modules.spectrogram import Spectrogram, SpectrogramConfig

# The two sets of apartments on which a network in training is measured, in this order.
SPLITS = ("validation", "training")


class ClipBatch(TypedDict):
    """N clips and what is to be known about them.

    clips (N, 2, rate) float32; target (N, 2) float32, metres right and front; in_sight (N,)
    bool; sound (N,) int64.
    """

    clips: Tensor
    target: Tensor
    in_sight: Tensor
    sound: Tensor


class PictureBatch(TypedDict):
    """The same of N clips as pictures (N, channels, bands, frames) float32."""

    pictures: Tensor
    target: Tensor
    in_sight: Tensor
    sound: Tensor


@dataclass
class OptimizerConfig:
    """The optimiser and its rate; any class of torch.optim that takes these two."""

    _target_: str = "torch.optim.AdamW"
    lr: float = 2e-3
    weight_decay: float = 1e-2


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


def build_part(config: Any, **given: Any) -> Any:
    """Build an object from its config; a mistake of the user's stays one."""
    try:
        return instantiate(config, **given)
    except InstantiationException as error:
        if isinstance(error.__cause__, UserError):
            raise error.__cause__ from None
        raise


class SoundCnn(L.LightningModule):
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
        if schedule not in ("cosine", "constant"):
            raise UserError(f"sound_model.schedule is '{schedule}'; give cosine or constant")
        for key, value in (("epochs", epochs), ("batch", batch), ("patience", patience)):
            if value < 1:
                raise UserError(f"sound_model.{key} is {value}; give at least 1")
        self.mirror, self.symmetric, self.train_seed = mirror, symmetric, train_seed
        self.spectrogram: Spectrogram = build_part(spectrogram)
        shape = (self.spectrogram.channels, self.spectrogram.bands, self.spectrogram.frames)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(train_seed)
            built = build_part(net, channels=shape[0], height=shape[1], width=shape[2])
        self.net: nn.Module = built.to(memory_format=torch.channels_last)
        self.training_loss = MeanSquaredError()
        # Plain lists: they take what is already on the CPU and are no part of a checkpoint.
        self.losses = [MeanSquaredError() for _ in SPLITS]
        self.errors: list[LocationErrors] = []
        self.measured: dict[str, float] = {}

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
        return self.estimate(self.spectrogram(clips))

    def estimate(self, pictures: Tensor) -> Tensor:
        """(N, channels, bands, frames) pictures to (N, 2) metres; see `forward`."""
        if not self.symmetric or self.training:
            return self._net(pictures)
        both = torch.cat((pictures, self.spectrogram.mirror(pictures)))
        straight, mirrored = self._net(both).chunk(2)
        return (straight + mirrored * mirrored.new_tensor((-1.0, 1.0))) / 2

    def _net(self, pictures: Tensor) -> Tensor:
        return self.net(pictures.contiguous(memory_format=torch.channels_last))

    def name_sounds(self, sounds: Sequence[str]) -> None:
        """Say what the sounds of the batches are called; the metrics are by these names."""
        self.errors = [LocationErrors(sounds) for _ in SPLITS]

    def training_step(self, batch: PictureBatch, index: int) -> Tensor:
        """The mean square error in square metres, with half of the clips mirrored."""
        pictures, target = batch["pictures"], batch["target"]
        if self.mirror:
            chosen = torch.rand(len(target)).lt(0.5).to(target.device)
            mirrored = self.spectrogram.mirror(pictures)
            pictures = torch.where(chosen[:, None, None, None], mirrored, pictures)
            target = torch.where(chosen[:, None], target * target.new_tensor((-1.0, 1.0)), target)
        estimate = self._net(pictures)
        loss = nn.functional.mse_loss(estimate, target)
        self.training_loss(estimate.detach().flatten(), target.flatten())
        return loss

    def on_train_epoch_start(self) -> None:
        """Draw dropout and mirroring from the epoch, so that a resumed run goes on exactly."""
        torch.manual_seed(self.train_seed * 1_000_003 + self.current_epoch)

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
            self.log_dict(values)
            self.measured |= {name: float(value) for name, value in values.items()}

    def configure_optimizers(self) -> OptimizerLRSchedulerConfig:
        """The optimiser of the recipe; the rate follows `schedule` step by step."""
        optimizer = build_part(self.hparams["optimizer"], params=list(self.net.parameters()))
        steps = int(self.trainer.estimated_stepping_batches)
        return {
            "optimizer": optimizer,
            "lr_scheduler": {
                "scheduler": LambdaLR(optimizer, self._rate(steps)),
                "interval": "step",
            },
        }

    def _rate(self, steps: int) -> Any:
        if self.hparams["schedule"] == "constant":
            return lambda step: 1.0
        warm = max(1, steps // 10)

        def factor(step: int) -> float:
            if step < warm:
                return (step + 1) / warm
            return 0.5 * (1 + math.cos(math.pi * min(1.0, (step - warm) / max(1, steps - warm))))

        return factor
