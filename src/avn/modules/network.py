"""What every network shares: the recipe that trains it, its seeds, and what it measured."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import lightning as L
import torch
from lightning.pytorch.utilities.types import OptimizerLRSchedulerConfig
from torch import nn
from torch.optim.lr_scheduler import LambdaLR

from avn.core.classes import build_part
from avn.core.errors import UserError

# The two sets of apartments on which a network in training is measured, in this order.
SPLITS = ("validation", "training")


# The config of a part that a network builds: `_target_` and arguments of that class.
Part = dict[str, Any]


@dataclass
class OptimizerConfig:
    """Optimiser of a network: any class of torch.optim that takes these two.

    Attributes
    ----------
    _target_ : str
        Module and name of the class.
    lr : float
        Learning rate.
    weight_decay : float
        Weight decay.
    """

    _target_: str = "torch.optim.AdamW"
    lr: float = 2e-3
    weight_decay: float = 1e-2


def as_part(config: Any) -> Part:
    """A config as a plain dict, which a checkpoint can hold."""
    return config if isinstance(config, dict) else dataclasses.asdict(config)


class Network(L.LightningModule):
    """A network with the recipe that trains it, as `avn.modules.training.fit` takes it.

    A subclass calls `save_hyperparameters`, then `check_recipe`, and builds `net`. Its batches are
    dicts with a `target`. In `on_validation_epoch_end` it logs what it measured and keeps it in
    `measured`, under the name `monitor` that by which checkpoints are chosen.

    Attributes
    ----------
    node : str
        The node of the config that holds the recipe.
    what, unit : str
        What it is called, and what its inputs are, for lines and bars.
    monitor, mode : str
        The figure by which a checkpoint is chosen, and whether "min" or "max" is best.
    measured : dict
        The figures after the last epoch.
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
        """Raise `UserError` where the recipe's lengths or its schedule cannot work."""
        schedule = self.hparams["schedule"]
        if schedule not in ("cosine", "constant"):
            raise UserError(f"{self.node}.schedule is '{schedule}'; give cosine or constant")
        for key in ("epochs", "batch", "patience"):
            if self.hparams[key] < 1:
                raise UserError(f"{self.node}.{key} is {self.hparams[key]}; give at least 1")

    def build(self, key: str, **given: Any) -> Any:
        """Build the part of the recipe under `key`; the weights are drawn from `train_seed`."""
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(self.hparams["train_seed"])
            return build_part(self.hparams[key], self.node, **given)

    def prepare(self, data: Any) -> None:
        """Learn of the data module what the metrics need, before training."""

    def on_train_epoch_start(self) -> None:
        """Draw all that is random from the epoch, so that a resumed run goes on exactly."""
        torch.manual_seed(self.hparams["train_seed"] * 1_000_003 + self.current_epoch)

    def keep(self, values: dict[str, Any]) -> None:
        """Log figures and keep them as `measured`."""
        self.log_dict(values)
        self.measured |= {name: float(value) for name, value in values.items()}

    def configure_optimizers(self) -> OptimizerLRSchedulerConfig:
        """The optimiser of the recipe; the rate follows `schedule` step by step."""
        learnt = [weight for weight in self.net.parameters() if weight.requires_grad]
        optimizer = build_part(self.hparams["optimizer"], self.node, params=learnt)
        steps = int(self.trainer.estimated_stepping_batches)
        schedule = LambdaLR(optimizer, rate_factor(self.hparams["schedule"], steps))
        return {
            "optimizer": optimizer,
            "lr_scheduler": {"scheduler": schedule, "interval": "step"},
        }


def rate_factor(schedule: str, steps: int) -> Callable[[int], float]:
    """Factor on the learning rate at each step of a training of `steps` steps.

    "constant" is 1; "cosine" rises over the first tenth and falls to 0.
    """
    if schedule == "constant":
        return lambda step: 1.0
    warm = max(1, steps // 10)

    def factor(step: int) -> float:
        if step < warm:
            return (step + 1) / warm
        return 0.5 * (1 + math.cos(math.pi * min(1.0, (step - warm) / max(1, steps - warm))))

    return factor
