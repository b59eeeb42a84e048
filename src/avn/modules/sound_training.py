"""Fits a sound network in a folder: checkpoints, TensorBoard, resuming."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import lightning as L
import torch
from lightning.pytorch.callbacks import Callback, EarlyStopping, ModelCheckpoint
from lightning.pytorch.loggers import TensorBoardLogger

from avn.datamodules.ahead import threads_for_one_operation
from avn.datamodules.sound import SoundData
from avn.errors import UserError
from avn.modules.sound_cnn import SPLITS, SoundCnn
from avn.progress import progress_bar
from avn.reporting.sound_figures import SoundFigures

BEST, LAST = "best.ckpt", "last.ckpt"
# Median over all validation clips: what a checkpoint is chosen by.
MONITOR = "error_m/validation/all/all"


def fit(
    data: SoundData, model: SoundCnn, folder: Path, accelerator: str = "auto"
) -> dict[str, Any]:
    """Train a sound network in a folder, or go on where a stopped training was.

    Writes TensorBoard's events, `best.ckpt` (lowest median error on the validation apartments)
    and `last.ckpt` into the folder. Sets the model's weights to the best ones. With the same
    recipe and the same machine the weights are the same, whether it was interrupted or not.

    Parameters
    ----------
    data : SoundData
    model : SoundCnn
        Built from the same recipe as `data`.
    folder : Path
    accelerator : str
        Lightning's name of the device to compute on.

    Returns
    -------
    dict
        `epochs` trained, the best `epoch`, and what was measured there: losses, medians in
        metres and degrees by split, sight and sound, such as `error_m/validation/in_sight/ring`.

    Raises
    ------
    UserError
        Where the folder holds a checkpoint of another config.
    """
    folder.mkdir(parents=True, exist_ok=True)
    last = folder / LAST
    if last.exists():
        _read_checkpoint(last, model)
    model.name_sounds(data.sounds.names)
    history = _History()
    # Patience and the best checkpoint come before the last one, which so holds their state.
    callbacks = [
        EarlyStopping(MONITOR, patience=model.hparams["patience"], check_on_train_epoch_end=True),
        history,
        SoundFigures(),
        _Progress(),
        _every_epoch(folder, BEST, MONITOR),
        _every_epoch(folder, LAST, None),
    ]
    cores = torch.get_num_threads()
    data.threads = max(1, cores // 2)
    learning = threads_for_one_operation(max(1, cores - data.threads))
    with _quiet(), learning, torch.random.fork_rng(devices=[]):
        trainer = L.Trainer(
            default_root_dir=folder,
            accelerator=accelerator,
            devices=1,
            max_epochs=model.hparams["epochs"],
            logger=TensorBoardLogger(folder, name="", version="", default_hp_metric=False),
            callbacks=callbacks,
            num_sanity_val_steps=0,
            enable_progress_bar=False,
            enable_model_summary=False,
            log_every_n_steps=20,
            deterministic=torch.cuda.is_available(),
        )
        trainer.fit(model, data, ckpt_path=str(last) if last.exists() else None)
    if trainer.interrupted or not trainer.state.finished:
        raise KeyboardInterrupt  # Lightning swallows it, and an unfinished network is none
    load_weights(model, folder / BEST)
    best = min(history.epochs, key=lambda epoch: epoch[MONITOR])
    return {"epochs": len(history.epochs), **best}


def _every_epoch(folder: Path, name: str, monitor: str | None) -> ModelCheckpoint:
    """Keep one checkpoint: of the epoch where `monitor` is lowest, or of the latest."""
    return ModelCheckpoint(
        dirpath=folder,
        filename=Path(name).stem,
        monitor=monitor,
        save_on_train_epoch_end=True,
        enable_version_counter=False,
    )


def load_weights(model: SoundCnn, path: Path) -> SoundCnn:
    """Give a network the weights of a checkpoint of the same recipe, and stop its training.

    Raises
    ------
    UserError
        Where the file is missing, is no checkpoint, or belongs to another config.
    """
    model.load_state_dict(_read_checkpoint(path, model)["state_dict"])
    return model.eval()


def _read_checkpoint(path: Path, model: SoundCnn) -> dict[str, Any]:
    """Read a checkpoint and compare its recipe with the model's."""
    try:
        checkpoint = torch.load(path, map_location="cpu", weights_only=True)
        recipe, _ = dict(checkpoint["hyper_parameters"]), checkpoint["state_dict"]
    except FileNotFoundError as error:
        raise UserError(
            f"{path}: no such checkpoint; delete {path.parent} to train again"
        ) from error
    except Exception as error:  # whatever a damaged file makes the reader raise
        raise UserError(
            f"{path}: not a checkpoint of the sound network; delete {path.parent} to train again"
        ) from error
    wanted = dict(model.hparams)
    for key, value in _flat(wanted).items():
        found = _flat(recipe).get(key, "missing")
        if found != value:
            raise UserError(
                f"{path}: checkpoint of another config (sound_model.{key} is {found} there, "
                f"{value} here); give the same value or train again"
            )
    return checkpoint


def _flat(config: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in config.items():
        name = f"{prefix}{key}"
        flat |= _flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return flat


class _History(Callback):
    """Remembers what was measured after each epoch, over interruptions too."""

    def __init__(self) -> None:
        self.epochs: list[dict[str, float]] = []

    def on_train_epoch_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        assert isinstance(pl_module, SoundCnn)
        self.epochs.append({"epoch": trainer.current_epoch, **pl_module.measured})

    def state_dict(self) -> dict[str, Any]:
        return {"epochs": self.epochs}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self.epochs = state_dict["epochs"]


class _Progress(Callback):
    """One bar for the whole training: clips heard, clips a second, time left."""

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        data = trainer.datamodule  # type: ignore[attr-defined]
        epoch = len(data.train_dataloader().sampler)
        measured = sum(len(loader.sampler) for loader in data.val_dataloader())
        left = (trainer.max_epochs or 0) - trainer.current_epoch
        self._stack = ExitStack()
        bar = progress_bar("training the sound network", left * (epoch + measured), "clips")
        self._advance = self._stack.enter_context(bar)

    def on_train_batch_end(self, *args: Any, **kwargs: Any) -> None:
        self._count(args)

    def on_validation_batch_end(self, *args: Any, **kwargs: Any) -> None:
        self._count(args)

    def _count(self, args: tuple[Any, ...]) -> None:
        # trainer, module, outputs, batch, ...
        self._advance(len(args[3]["target"]))

    def on_train_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        self._stack.close()

    def on_exception(
        self, trainer: L.Trainer, pl_module: L.LightningModule, exception: BaseException
    ) -> None:
        if hasattr(self, "_stack"):
            self._stack.close()


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Lightning from advertising devices and worker counts that do not apply here."""
    logger = logging.getLogger("lightning.pytorch")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module="lightning.*")
            warnings.filterwarnings("ignore", message=".*isinstance.*LeafSpec.*")
            yield
    finally:
        logger.setLevel(level)


__all__ = ["BEST", "LAST", "SPLITS", "fit", "load_weights"]
