"""Callbacks of every training with Lightning: history, progress, batches that stay the same."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

import lightning as L
import torch
from lightning.pytorch.callbacks import Callback

from avn.core.errors import UserError
from avn.core.progress import progress_bar
from avn.modules.network import Network


class History(Callback):
    """Metrics after each epoch, kept in checkpoints.

    Attributes
    ----------
    epochs : list of dict
        Metrics of each epoch by name, and its number, `epoch`.
    """

    def __init__(self) -> None:
        self.epochs: list[dict[str, float]] = []

    def on_train_epoch_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """See `Callback.on_train_epoch_end`."""
        assert isinstance(pl_module, Network)
        self.epochs.append({"epoch": trainer.current_epoch, **pl_module.measured})

    def state_dict(self) -> dict[str, Any]:
        """Return the metrics of all epochs."""
        return {"epochs": self.epochs}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Restore what `state_dict` returned."""
        self.epochs = state_dict["epochs"]


class FiniteWeights(Callback):
    """Error where a training has diverged, before its weights are measured and kept."""

    def on_validation_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """See `Callback.on_validation_start`."""
        assert isinstance(pl_module, Network)
        if not all(torch.isfinite(own).all() for own in pl_module.parameters()):
            raise UserError(
                f"{pl_module.what}: its weights are not finite after epoch "
                f"{trainer.current_epoch + 1}; give a lower {pl_module.node}.optimizer.lr, "
                "trainer.gradient_clip_val=1 or trainer.precision=32"
            )


class FixedEpoch(Callback):
    """Repetition of the batches of the first epoch in every epoch."""

    def on_train_epoch_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """See `Callback.on_train_epoch_start`."""
        trainer.train_dataloader.sampler.set_epoch(0)  # type: ignore[union-attr]


class FreshStart(Callback):
    """Removal of the callbacks' states from the checkpoint of another training.

    Its best metric and its patience are of other data.
    """

    def on_load_checkpoint(
        self, trainer: L.Trainer, pl_module: L.LightningModule, checkpoint: dict[str, Any]
    ) -> None:
        """See `Callback.on_load_checkpoint`."""
        checkpoint["callbacks"].clear()


class Progress(Callback):
    """Progress bar over the whole training, counted in inputs."""

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """See `Callback.on_train_start`."""
        assert isinstance(pl_module, Network)
        data = trainer.datamodule  # type: ignore[attr-defined]
        loaders = [data.train_dataloader(), *data.val_dataloader()]
        batches = [trainer.num_training_batches, *trainer.num_val_batches]
        epoch = sum(
            min(len(loader.sampler), int(count) * loader.batch_size)
            for loader, count in zip(loaders, batches, strict=True)
        )
        left = (trainer.max_epochs or 0) - trainer.current_epoch
        self._stack = ExitStack()
        bar = progress_bar(f"training the {pl_module.what}", left * epoch, pl_module.unit)
        self._advance = self._stack.enter_context(bar)

    def on_train_batch_end(self, *args: Any, **kwargs: Any) -> None:
        """See `Callback.on_train_batch_end`."""
        self._count(args)

    def on_validation_batch_end(self, *args: Any, **kwargs: Any) -> None:
        """See `Callback.on_validation_batch_end`."""
        self._count(args)

    def _count(self, args: tuple[Any, ...]) -> None:
        # trainer, module, outputs, batch, ...
        self._advance(len(args[3]["target"]))

    def on_train_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """See `Callback.on_train_end`."""
        self._stack.close()

    def on_exception(
        self, trainer: L.Trainer, pl_module: L.LightningModule, exception: BaseException
    ) -> None:
        """See `Callback.on_exception`."""
        if hasattr(self, "_stack"):
            self._stack.close()
