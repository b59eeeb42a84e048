"""Base class of the stages of networks that Lightning fits to a data module."""

from __future__ import annotations

import dataclasses
from abc import abstractmethod
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from avn.core.settings import leaves, plain, typed
from avn.modules.settings import BEST, OF_ONE, SAME_WEIGHTS, TrainerConfig
from avn.pipeline.trained import Trained

if TYPE_CHECKING:
    import lightning as L
    from lightning.pytorch.callbacks import Callback

    from avn.modules.network import Network


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
        if self.published:
            model.load_state_dict(self.published.weights())
            return model.eval()
        training.load_weights(model, self.folder / BEST)
        self.check_weights()
        return model
