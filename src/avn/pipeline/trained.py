"""Base classes of trained networks as stages: a folder with checkpoints and metrics."""

from __future__ import annotations

import dataclasses
import json
from abc import abstractmethod
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, ClassVar

from avn.core.errors import UserError
from avn.core.files import atomic_write, stage_folder
from avn.core.hashing import file_hash
from avn.core.settings import leaves, plain, typed, values
from avn.modules.settings import BEST, LAST, OF_ONE, SAME_WEIGHTS, TrainerConfig
from avn.pipeline.apartments import TRAINING, Apartments
from avn.pipeline.stage import Stage, with_sources
from avn.reporting.events import write_summary
from avn.reporting.model_card import write_card

if TYPE_CHECKING:
    import lightning as L
    from lightning.pytorch.callbacks import Callback
    from lightning.pytorch.loggers import Logger

    from avn.modules.network import Network

METRICS, CHECKSUM = "metrics.json", "best.ckpt sha256"


class Trained(Stage):
    """Stage of a network that is trained in the training world.

    Attributes
    ----------
    kind : str
        `train/<name of its folder>`.
    node : str
        Config node of the recipe.
    """

    node: ClassVar[str]

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

    @property
    def start(self) -> Path | None:
        """Checkpoint of another training from which this one goes on, if any."""
        given = self.cfg[self.node].ckpt_path
        path = None if given is None else Path(given).expanduser()
        if path is not None and not path.is_file():
            raise UserError(f"ckpt_path: {path}: no such file")
        return path

    def inputs(self) -> list[Any]:
        """Return the values of the settings, of the trainer too where they are not the default."""
        start = f"{self.node}.ckpt_path"
        recipe = values(self.cfg, self.settings(), (*self.ignored(), start))
        begun = [] if self.start is None else [{start: file_hash(self.start)}]
        return with_sources([*recipe, *begun, *self.trainer_inputs()])

    def trainer_inputs(self) -> list[Any]:
        """Return the settings of trainer and callbacks that change the product."""
        return []

    def read_here(self) -> set[str]:
        """Return the keys that it reads, among them those of the loggers."""
        return super().read_here() | leaves(self.cfg, ("logger",))

    def loggers(self, step: int = 0) -> list[Logger]:
        """Return the loggers of the training; `step` is the first of a resumed one."""
        from avn.modules.attachments import build_loggers

        return build_loggers(plain(self.cfg, "logger"), self.folder, self.run_name, step)

    def read_alone(self) -> set[str]:
        """Return the keys that it reads as the network that `avn.train` names."""
        return {"model.name", "ckpt_path", "trainer.fast_dev_run"}

    def check(self) -> None:
        """Refuse loggers that do not exist."""
        from avn.modules.attachments import check_attachments

        check_attachments(plain(self.cfg, "logger"), {})

    @abstractmethod
    def trial(self, batches: int) -> None:
        """Train a few batches and measure once, in a folder that is deleted afterwards."""

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
        """Write the row of the training in the HPARAMS tab, if it logs to TensorBoard."""
        if not any("TensorBoard" in str(own["_target_"]) for own in self.cfg.logger.values()):
            return
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

    def read_alone(self) -> set[str]:
        """Return the keys that it reads as the network that `avn.train` names."""
        return super().read_alone() | {"trainer.overfit_batches"}

    def check(self) -> None:
        """Refuse an invalid recipe, and settings of the trainer that cannot work."""
        from avn.modules.attachments import check_attachments
        from avn.modules.checkpoints import check_start
        from avn.modules.trainer import check_trainer

        super().check()
        model = self.untrained()
        check_trainer(self.trainer)
        if self.start is not None and not self.begun():
            check_start(self.start, model, self.epochs)
        check_attachments({}, plain(self.cfg, "callbacks"))

    @property
    def trainer(self) -> TrainerConfig:
        """Settings of the trainer."""
        settings: TrainerConfig = typed(self.cfg.trainer)
        return settings

    @property
    def epochs(self) -> int:
        """Maximum number of epochs."""
        return int(self.cfg.trainer.max_epochs or self.cfg[self.node].epochs)

    def in_epoch(self, inputs: int) -> int:
        """Return how many of a number of inputs an epoch of this training has."""
        few = self.cfg.trainer.overfit_batches * self.cfg[self.node].batch
        return min(inputs, few) if few else inputs

    def trainer_inputs(self) -> list[Any]:
        """Return the settings of trainer and callbacks that change the product."""
        usual, callbacks = TrainerConfig(), plain(self.cfg, "callbacks")
        changed = {
            key: value
            for key, value in plain(self.cfg, "trainer").items()
            if key not in SAME_WEIGHTS and value != getattr(usual, key)
        }
        return [given for given in (changed, callbacks) if given]

    def read_here(self) -> set[str]:
        """Return the keys that it reads, among them those of the trainer."""
        of_one = [f"trainer.{key}" for key in OF_ONE]
        return super().read_here() | leaves(self.cfg, ("trainer", "callbacks"), of_one)

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
        metrics = training.fit(
            data,
            model,
            self.folder,
            [*self.callbacks(), *self._added(self.folder)],
            self.loggers(),
            dataclasses.replace(self.trainer, fast_dev_run=0),
            self.start,
        )
        self.finish(metrics | self.measure(model, data), dict(model.hparams))

    def trial(self, batches: int) -> None:
        """Train a few batches and measure once, in a folder that is deleted afterwards."""
        from avn.modules import training

        trainer = dataclasses.replace(self.trainer, fast_dev_run=batches)
        with TemporaryDirectory() as parent:
            folder = Path(parent) / self.folder.name
            callbacks = [*self.callbacks(), *self._added(folder)]
            training.fit(self.data(), self.untrained(), folder, callbacks, (), trainer, self.start)

    def _added(self, folder: Path) -> Sequence[Callback]:
        from avn.modules.attachments import build_callbacks

        return build_callbacks(plain(self.cfg, "callbacks"), folder)

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
