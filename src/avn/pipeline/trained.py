"""Base classes of trained networks as stages: a folder with checkpoints and metrics."""

from __future__ import annotations

import json
from abc import abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from avn.core.errors import UserError
from avn.core.files import atomic_write, stage_folder
from avn.core.hashing import file_hash
from avn.modules.settings import BEST, LAST
from avn.pipeline.apartments import TRAINING, Apartments
from avn.pipeline.stage import Stage
from avn.reporting.events import write_summary
from avn.reporting.model_card import write_card

if TYPE_CHECKING:
    import lightning as L
    from lightning.pytorch.callbacks import Callback

    from avn.modules.network import Network

METRICS, CHECKSUM = "metrics.json", "best.ckpt sha256"


class Trained(Stage):
    """Stage of a network that is trained in the training world.

    Attributes
    ----------
    kind : str
        `train/<name of its folder>`.
    """

    @property
    def train(self) -> Apartments:
        """Apartments of the training data."""
        return Apartments(self.cfg, "train", TRAINING)

    @property
    def validation(self) -> Apartments:
        """Apartments on which the best epoch is selected."""
        return Apartments(self.cfg, "validation", TRAINING)

    @property
    def name(self) -> str:
        """Name of the folder, without the hash."""
        return self.kind.split("/")[1]

    @property
    def folder(self) -> Path:
        """`outputs/train/<name>-<hash8>`."""
        return stage_folder(self.cfg.outputs, "train", self.name, self.fingerprint)

    def done(self) -> bool:
        """Return whether the training is finished."""
        return (self.folder / METRICS).is_file()

    def begun(self) -> bool:
        """Return whether an interrupted training has left a checkpoint."""
        return (self.folder / LAST).is_file()

    def metrics(self) -> dict[str, Any]:
        """Read the metrics of the training; raise `UserError` where the file is damaged."""
        path = self.folder / METRICS
        try:
            return dict(json.loads(path.read_text()))
        except (OSError, ValueError) as error:
            raise UserError(f"{path}: damaged; delete {self.folder} to train again") from error

    def finish(self, metrics: dict[str, Any], recipe: dict[str, Any]) -> None:
        """Write the model card and `metrics.json`, which marks the training as finished."""
        metrics = metrics | {CHECKSUM: file_hash(self.folder / BEST)}
        self._write_events(metrics)
        write_card(self.folder, self.title, self._setting(), recipe, metrics)
        with atomic_write(self.folder / METRICS) as part:
            part.write_text(json.dumps(metrics, indent=1, sort_keys=True) + "\n")
        self._write_events(metrics)

    @property
    def seed(self) -> int:
        """Seed of the training."""
        return int(self.cfg.train_seed)

    @property
    def run_name(self) -> str:
        """Name of the training in TensorBoard: model, world, sounds of the training and seed."""
        parts = [self.name, *self._world().values(), f"seed{self.seed}"]
        return "-".join(str(part).replace("/", "_") for part in parts)

    def _world(self) -> dict[str, str]:
        """Return the parts of the training world that the network depends on."""
        read = {key.rsplit(".", 1)[0] for key in self.read()}
        world = {}
        if TRAINING.acoustics in read:
            world["acoustics"] = str(self.train.node("acoustics").name)
        world["split"] = str(self.train.node("split").name)
        if TRAINING.sounds in read:
            world["sounds_in_training"] = "+".join(map(str, self.train.node("sounds")))
        return world

    def _write_events(self, metrics: dict[str, Any]) -> None:
        """Write the row of the training in the HPARAMS tab of TensorBoard."""
        settings = {"kind": "training", "agent": self.name, "train_seed": self.seed}
        best = metrics.get(self.monitor, metrics.get(f"best/{self.monitor}"))
        found = {} if best is None else {"best_validation": float(best)}
        folder = self.folder / self.run_name
        write_summary(folder, settings | self._world(), found, {}, suffix=".hparams")

    @property
    def monitor(self) -> str:
        """Metric by which the best epoch or round is chosen."""
        return ""

    def check_weights(self) -> None:
        """Raise `UserError` where the best checkpoint has changed since the training."""
        best = self.folder / BEST
        if self.metrics().get(CHECKSUM) != file_hash(best):
            raise UserError(
                f"{best}: changed since it was trained; delete {self.folder} to train again"
            )

    def _setting(self) -> dict[str, str]:
        """Return the data of training and validation, for the model card."""
        split, acoustics = self.train.node("split").name, self.train.node("acoustics").name
        return {
            "setting": f"split `{split}`, acoustics `{acoustics}`",
            "training apartments": ", ".join(plan.name for plan in self.train.plans),
            "validation apartments": ", ".join(plan.name for plan in self.validation.plans),
        }


class Fitted(Trained):
    """Stage of a network that Lightning fits to a data module."""

    @abstractmethod
    def untrained(self) -> Network:
        """Return the network with its initial weights."""

    @abstractmethod
    def data(self) -> L.LightningDataModule:
        """Return the data module."""

    @property
    def monitor(self) -> str:
        """Metric by which the best epoch is chosen."""
        return str(self.untrained().monitor)

    def check(self) -> None:
        """Refuse an invalid recipe."""
        self.untrained()

    def measure(self, model: Any, data: Any) -> dict[str, Any]:
        """Compute metrics of the trained network in addition to those of the training."""
        return {}

    def callbacks(self) -> Sequence[Callback]:
        """Return callbacks of the training, such as those that log figures to TensorBoard."""
        return ()

    def make(self) -> None:
        """Train the network, or resume an interrupted training."""
        from avn.modules import training

        model = self.untrained()
        data = self.data()
        metrics = training.fit(data, model, self.folder, self.callbacks(), run_name=self.run_name)
        self.finish(metrics | self.measure(model, data), dict(model.hparams))

    def load(self) -> Any:
        """Return the trained network.

        Raises
        ------
        UserError
            Where a checkpoint belongs to another config, or has changed since it was trained.
        """
        from avn.modules import training

        model = self.untrained()
        training.load_weights(model, self.folder / BEST)
        self.check_weights()
        return model
