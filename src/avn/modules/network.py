"""Base class of trainable networks: training recipe, seeding, logged metrics."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any, ClassVar

import lightning as L
import torch
from lightning.pytorch.utilities.types import OptimizerLRSchedulerConfig
from torch import nn
from torch.optim.lr_scheduler import LambdaLR

from avn.core.classes import build_part
from avn.core.errors import UserError

# Subsets of the split on which metrics are computed after each epoch, in the order of loaders.
SUBSETS = ("validation", "train")


# Config of a submodule: `_target_` and arguments of that class.
Part = dict[str, Any]


def as_part(config: Any) -> Part:
    """Return a config as a plain dict, which a checkpoint can hold."""
    return config if isinstance(config, dict) else dataclasses.asdict(config)


class Network(L.LightningModule):
    """Network with a training recipe, as `avn.modules.training.fit` takes it.

    A subclass calls `save_hyperparameters`, then `check_recipe`, and builds `net`. Its batches are
    dicts with a `target`. In `on_validation_epoch_end` it passes its metrics to `keep`; one of them
    is `monitor`, by which the best checkpoint is selected.

    Attributes
    ----------
    node : str
        Config node that holds the recipe.
    what, unit : str
        Name of the network and of its inputs, for messages and progress bars.
    monitor, mode : str
        Metric by which the best checkpoint is selected, and whether "min" or "max" is best.
    measured : dict of str to float
        Metrics after the last epoch.
    """

    node: ClassVar[str]
    what: ClassVar[str]
    unit: ClassVar[str]
    monitor: ClassVar[str]
    mode: ClassVar[str] = "min"

    net: nn.Module

    def __init__(self) -> None:
        super().__init__()
        self.measured: dict[str, float] = {}

    def check_recipe(self) -> None:
        """Raise `UserError` for an unknown schedule or a length below 1."""
        schedule = self.hparams["schedule"]
        if schedule not in ("cosine", "constant"):
            raise UserError(f"{self.node}.schedule is '{schedule}'; give cosine or constant")
        for key in ("epochs", "batch", "patience"):
            if self.hparams[key] < 1:
                raise UserError(f"{self.node}.{key} is {self.hparams[key]}; give at least 1")

    def build(self, key: str, **given: Any) -> Any:
        """Build the submodule that the recipe describes under `key`.

        The initial weights are drawn from `train_seed`.
        """
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(self.hparams["train_seed"])
            return build_part(self.hparams[key], self.node, **given)

    def prepare(self, data: Any) -> None:
        """Read what the metrics need from the data module, before training."""

    def on_train_epoch_start(self) -> None:
        """Seed the epoch from `train_seed` and its number, so that a resumed run is identical."""
        torch.manual_seed(self.hparams["train_seed"] * 1_000_003 + self.current_epoch)

    def keep(self, values: dict[str, Any]) -> None:
        """Log metrics and keep them in `measured`."""
        self.log_dict(values)
        self.measured |= {name: float(value) for name, value in values.items()}

    def configure_optimizers(self) -> OptimizerLRSchedulerConfig:
        """Build the optimiser of the recipe, with `schedule` applied at every step."""
        learnt = [weight for weight in self.parameters() if weight.requires_grad]
        optimizer = build_part(self.hparams["optimizer"], self.node, params=learnt)
        steps = int(self.trainer.estimated_stepping_batches)
        schedule = LambdaLR(optimizer, rate_factor(self.hparams["schedule"], steps))
        return {
            "optimizer": optimizer,
            "lr_scheduler": {"scheduler": schedule, "interval": "step"},
        }


def rate_factor(schedule: str, steps: int) -> Callable[[int], float]:
    """Return the function from step to learning-rate factor, for a training of `steps` steps.

    "constant" is 1; "cosine" is a linear warm-up over the first tenth of the steps, then a cosine
    decay to 0.
    """
    if schedule == "constant":
        return lambda step: 1.0
    warm = max(1, steps // 10)

    def factor(step: int) -> float:
        if step < warm:
            return (step + 1) / warm
        return 0.5 * (1 + math.cos(math.pi * min(1.0, (step - warm) / max(1, steps - warm))))

    return factor
