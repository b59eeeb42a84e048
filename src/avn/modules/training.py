"""Training of networks with Lightning: checkpoints, TensorBoard, resuming."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import lightning as L
import torch
from lightning.fabric.utilities.exceptions import MisconfigurationException
from lightning.pytorch.callbacks import Callback, EarlyStopping, ModelCheckpoint
from lightning.pytorch.loggers import Logger

from avn.core.errors import UserError
from avn.core.prefetch import threads_for_one_operation
from avn.modules.checkpoints import check_start, read_checkpoint
from avn.modules.fit_callbacks import FiniteWeights, FixedEpoch, FreshStart, History, Progress
from avn.modules.network import Network
from avn.modules.settings import BEST, LAST, TrainerConfig
from avn.modules.trainer import build_trainer, quiet

Trained = TypeVar("Trained", bound=Network)


def fit(
    data: L.LightningDataModule,
    model: Network,
    folder: Path,
    callbacks: Sequence[Callback] = (),
    loggers: Sequence[Logger] = (),
    trainer: TrainerConfig | None = None,
    start: Path | None = None,
) -> dict[str, Any]:
    """Train a network in a folder, or resume an interrupted training.

    Writes `best.ckpt` (the best epoch by the model's `monitor`) and `last.ckpt` into the folder,
    and sets the model's weights to the best ones; with `fast_dev_run` it writes nothing. The same
    recipe on the same machine gives the same weights, also after an interruption.

    Parameters
    ----------
    data : LightningDataModule
        Data module with an attribute `threads`, the number of threads that make batches, and
        loaders with samplers.
    model : Network
        Network that is built from the same recipe as `data`.
    folder : Path
        Folder of the checkpoints; created if missing.
    callbacks : sequence of Callback
        Further callbacks, such as those that log figures.
    loggers : sequence of Logger
        Loggers of curves and figures.
    trainer : TrainerConfig, optional
        Settings of the trainer.
    start : Path, optional
        Checkpoint of another training, from which this one goes on: weights, optimiser, number of
        epochs.

    Returns
    -------
    dict
        Number of `epochs` trained, best `epoch`, and the metrics of that epoch.

    Raises
    ------
    UserError
        Where the folder holds a checkpoint of another config, `start` does not fit, or Lightning
        refuses a setting.
    """
    settings = trainer or TrainerConfig()
    folder.mkdir(parents=True, exist_ok=True)
    resumed = (folder / LAST).exists()
    if resumed:
        read_checkpoint(folder / LAST, model)
    elif start is not None:
        check_start(start, model, settings.max_epochs or model.hparams["epochs"])
    model.prepare(data)
    history = History()
    lightning = build_trainer(
        settings,
        model.hparams["epochs"],
        folder,
        loggers,
        [
            *_stopping(model, settings),
            FiniteWeights(),
            history,
            *callbacks,
            Progress(),
            *([FixedEpoch()] if settings.overfit_batches else []),
            *([FreshStart()] if start is not None and not resumed else []),
            # The last checkpoint comes last, and so holds the state of all others.
            _every_epoch(folder, BEST, model.monitor, model.mode),
            _every_epoch(folder, LAST, None),
        ],
    )
    going_on = folder / LAST if resumed else start
    with quiet(), _cores_divided(data), torch.random.fork_rng(devices=[]):
        _run(lightning, model, data, going_on)
    if not settings.fast_dev_run:
        load_weights(model, folder / BEST)
    sign = 1 if model.mode == "min" else -1
    best = min(history.epochs, key=lambda epoch: sign * epoch[model.monitor])
    return {"epochs": len(history.epochs), **best}


def _stopping(model: Network, settings: TrainerConfig) -> list[Callback]:
    if settings.overfit_batches:  # gets worse on validation by intention
        return []
    return [
        EarlyStopping(
            model.monitor,
            mode=model.mode,
            patience=model.hparams["patience"],
            check_on_train_epoch_end=True,
        )
    ]


@contextmanager
def _cores_divided(data: Any) -> Iterator[None]:
    """Divide the cores among the threads that make batches and the network."""
    cores = torch.get_num_threads()
    data.threads = max(1, cores // 2)
    with threads_for_one_operation(max(1, cores - data.threads)):
        yield


def _run(trainer: L.Trainer, model: Network, data: Any, checkpoint: Path | None) -> None:
    try:
        trainer.fit(model, data, ckpt_path=None if checkpoint is None else str(checkpoint))
    except SystemExit as error:  # of Lightning, for Ctrl-C outside of a command
        raise KeyboardInterrupt from error
    except MisconfigurationException as error:
        line = " ".join(str(error).split())
        raise UserError(f"trainer, logger or callbacks: {line}") from error
    if trainer.interrupted or not trainer.state.finished:
        raise KeyboardInterrupt  # Lightning swallows it, and an unfinished network is none


def _every_epoch(
    folder: Path, name: str, monitor: str | None, mode: str = "min"
) -> ModelCheckpoint:
    """Return a callback that keeps one checkpoint: the best by `monitor`, or the latest."""
    return ModelCheckpoint(
        dirpath=folder,
        filename=Path(name).stem,
        monitor=monitor,
        mode=mode,
        save_on_train_epoch_end=True,
        enable_version_counter=False,
    )


def load_weights(model: Trained, path: Path) -> Trained:
    """Load the weights of a checkpoint of the same recipe and set the network to evaluation.

    Raises
    ------
    UserError
        Where the file is missing, is no checkpoint, or belongs to another config.
    """
    model.load_state_dict(read_checkpoint(path, model)["state_dict"])
    return model.eval()
