"""Trained networks as stages: a folder with checkpoints and what was measured."""

from __future__ import annotations

import json
from abc import abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import lightning as L
from lightning.pytorch.callbacks import Callback

from avn.core.errors import UserError
from avn.core.files import atomic_write, stage_folder
from avn.core.hashing import file_hash
from avn.modules import training
from avn.modules.network import Network
from avn.pipeline.apartments import TRAINING, Apartments
from avn.pipeline.stage import Stage
from avn.reporting.model_card import write_card

METRICS, CHECKSUM = "metrics.json", "best.ckpt sha256"


class Trained(Stage):
    """A network with its weights, trained in the training world.

    Attributes
    ----------
    kind : str
        `train/<name of its folder>`.
    """

    @property
    def train(self) -> Apartments:
        """The apartments on which it is trained."""
        return Apartments(self.cfg, "train", TRAINING)

    @property
    def validation(self) -> Apartments:
        """The apartments on which its best epoch is chosen."""
        return Apartments(self.cfg, "validation", TRAINING)

    @property
    def name(self) -> str:
        """The name of its folder, before the hash."""
        return self.kind.split("/")[1]

    @property
    def folder(self) -> Path:
        """`outputs/train/<name>-<hash8>`."""
        return stage_folder(self.cfg.outputs, "train", self.name, self.fingerprint)

    def done(self) -> bool:
        """Whether it has been trained to the end."""
        return (self.folder / METRICS).is_file()

    def metrics(self) -> dict[str, Any]:
        """What its training measured; raises `UserError` where the file is damaged."""
        path = self.folder / METRICS
        try:
            return dict(json.loads(path.read_text()))
        except (OSError, ValueError) as error:
            raise UserError(f"{path}: damaged; delete {self.folder} to train again") from error

    def finish(self, metrics: dict[str, Any], recipe: dict[str, Any]) -> None:
        """Write `metrics.json` and the model card, which end a training."""
        metrics = metrics | {CHECKSUM: file_hash(self.folder / training.BEST)}
        with atomic_write(self.folder / METRICS) as part:
            part.write_text(json.dumps(metrics, indent=1, sort_keys=True) + "\n")
        write_card(self.folder, self.title, self._setting(), recipe, metrics)

    def check_weights(self) -> None:
        """Raise `UserError` where the best checkpoint is not the one that was measured."""
        best = self.folder / training.BEST
        if self.metrics().get(CHECKSUM) != file_hash(best):
            raise UserError(
                f"{best}: changed since it was trained; delete {self.folder} to train again"
            )

    def _setting(self) -> dict[str, str]:
        """What it was trained and measured on, for the card."""
        split, acoustics = self.train.node("split").name, self.train.node("acoustics").name
        return {
            "setting": f"split `{split}`, acoustics `{acoustics}`",
            "training apartments": ", ".join(plan.name for plan in self.train.plans),
            "validation apartments": ", ".join(plan.name for plan in self.validation.plans),
        }


class Fitted(Trained):
    """A network that Lightning fits to a data module."""

    @abstractmethod
    def untrained(self) -> Network:
        """The network of the config, with the weights that training begins with."""

    @abstractmethod
    def data(self) -> L.LightningDataModule:
        """What it is trained on."""

    def check(self) -> None:
        """Refuse a recipe that cannot work."""
        self.untrained()

    def measure(self, model: Any, data: Any) -> dict[str, Any]:
        """Metrics of the trained network beside those of the training."""
        return {}

    def callbacks(self) -> Sequence[Callback]:
        """Callbacks of the training, such as those that show figures in TensorBoard."""
        return ()

    def make(self) -> None:
        """Train it, or go on where a killed training was."""
        model = self.untrained()
        data = self.data()
        metrics = training.fit(data, model, self.folder, self.callbacks())
        self.finish(metrics | self.measure(model, data), dict(model.hparams))

    def load(self) -> Any:
        """The trained network.

        Raises
        ------
        UserError
            Where a checkpoint belongs to another config, or has changed since it was trained.
        """
        model = self.untrained()
        training.load_weights(model, self.folder / training.BEST)
        self.check_weights()
        return model
