"""Base classes of trained networks as stages: a folder with checkpoints and metrics."""

from __future__ import annotations

import copy
import json
from abc import abstractmethod
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from avn.acoustics.sound_names import joined_names
from avn.core.errors import UserError
from avn.core.files import atomic_write, stage_folder
from avn.core.hashing import digest, file_hash
from avn.core.settings import leaves, plain, values
from avn.modules.settings import BEST, LAST
from avn.pipeline.apartments import TRAINING, Apartments
from avn.pipeline.published_networks import (
    PUBLISHED,
    TRAINED,
    PublishedNetwork,
    check_networks,
    published_network,
)
from avn.pipeline.stage import Stage, with_sources
from avn.reporting.events import write_summary
from avn.reporting.model_card import write_card

if TYPE_CHECKING:
    from lightning.pytorch.loggers import Logger


METRICS, CHECKSUM = "metrics.json", "best.ckpt sha256"
# Key of the config that says whether networks are trained or published.
NETWORKS = "networks"


class Trained(Stage):
    """Stage of a network that is trained in the training world.

    With `networks=published` it is the network of the package that the training would make: it has
    no needs and reads the same settings.

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

    @cached_property
    def published(self) -> PublishedNetwork | None:
        """Network of the package in place of the training, with `networks=published`.

        Raises
        ------
        UserError
            Where the package has no network of these settings.
        """
        networks = self.cfg.get(NETWORKS, TRAINED)
        check_networks(networks)
        if networks != PUBLISHED:
            return None
        scenes = self.cfg.training.scenes.name
        return published_network(self._training.fingerprint, self.title, scenes)

    @cached_property
    def _training(self) -> Trained:
        """Stage of the training, where the network is published."""
        cfg = copy.deepcopy(self.cfg)
        cfg[NETWORKS] = TRAINED
        return type(self)(cfg)

    @cached_property
    def needed(self) -> tuple[Stage, ...]:
        """Result of `needs`, cached; nothing for a published network."""
        return () if self.published else tuple(self.needs())

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of all that the network depends on; of a published one, of its weights."""
        if self.published:
            return digest(self.kind, PUBLISHED, self.published.sha256)
        return super().fingerprint

    @property
    def folder(self) -> Path:
        """`outputs/train/<name>-<hash8>`, or the folder of published networks."""
        if self.published:
            return self.published.path.parent
        return stage_folder(self.cfg.outputs, "train", self.name, self.fingerprint)

    def done(self) -> bool:
        """Return whether the training is finished; a published network is."""
        return self.published is not None or (self.folder / METRICS).is_file()

    def discard(self) -> None:
        """Delete the training, so that it is made anew; a published network stays."""
        if not self.published:
            super().discard()

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
        if self.published:
            return self._training.read() | {NETWORKS}
        own = {NETWORKS} & set(self.cfg)
        return super().read_here() | leaves(self.cfg, ("logger",)) | own

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
        if self.published:
            return self.published.metrics
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
            world["sounds_in_training"] = joined_names([*map(str, self.train.node("sounds"))])
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
