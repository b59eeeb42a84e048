"""The Lightning trainer of a network, from the settings of the group `trainer`."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import lightning as L
import torch
from lightning.pytorch.callbacks import Callback
from lightning.pytorch.loggers import Logger
from lightning.pytorch.plugins.environments import LightningEnvironment
from lightning.pytorch.profilers import (
    AdvancedProfiler,
    Profiler,
    PyTorchProfiler,
    SimpleProfiler,
)

from avn.core.errors import UserError
from avn.core.numerics import is_portable
from avn.modules.settings import TrainerConfig

PROFILERS: dict[str, type[Profiler]] = {
    "simple": SimpleProfiler,
    "advanced": AdvancedProfiler,
    "pytorch": PyTorchProfiler,
}

# Number formats, by their names and short names. In others, labels and metrics lose digits.
_PRECISIONS = {
    "32-true": "32-true",
    "bf16-mixed": "bf16-mixed",
    "16-mixed": "16-mixed",
    "32": "32-true",
    "bf16": "bf16-mixed",
    "16": "16-mixed",
}
# Device and number format of `numerics=portable`.
_PORTABLE = ("cpu", "32-true")


def check_trainer(settings: TrainerConfig) -> None:
    """Refuse settings that cannot work on this machine.

    Raises
    ------
    UserError
        The message names the setting.
    """
    one = settings.devices
    if isinstance(one, bool) or not (one in (1, "1") or _is_one_index(one)):
        raise UserError(
            f"trainer.devices: {one}; a network is trained on one device, give 1 or its index in "
            "brackets, such as [1]"
        )
    for key, least in (("max_epochs", 1), ("overfit_batches", 0), ("fast_dev_run", 0)):
        value = getattr(settings, key)
        if value is not None and value < least:
            raise UserError(f"trainer.{key}: {value}; give {least} or more")
    clip = settings.gradient_clip_val
    if clip is not None and not clip > 0:
        raise UserError(f"trainer.gradient_clip_val: {clip}; give more than 0, or null")
    if settings.profiler not in (None, *PROFILERS):
        known = ", ".join(PROFILERS)
        raise UserError(f"trainer.profiler: '{settings.profiler}' is none of {known}")
    if settings.precision not in _PRECISIONS:
        known = ", ".join(_PRECISIONS)
        raise UserError(f"trainer.precision: '{settings.precision}' is none of {known}")
    trainer = build_trainer(settings, epochs=1, folder=Path())
    if (
        trainer.precision != _PRECISIONS[settings.precision]
    ):  # Lightning replaces what a device cannot do
        raise UserError(
            f"trainer.precision: {settings.precision} is not possible with this device; give "
            f"{trainer.precision} or 32-true"
        )
    if is_portable() and (trainer.strategy.root_device.type, trainer.precision) != _PORTABLE:
        raise UserError(
            "numerics: portable needs trainer.accelerator=cpu and trainer.precision=32-true"
        )


def _is_one_index(devices: Any) -> bool:
    return isinstance(devices, Sequence) and not isinstance(devices, str) and len(devices) == 1


def build_trainer(
    settings: TrainerConfig,
    epochs: int,
    folder: Path,
    loggers: Sequence[Logger] = (),
    callbacks: Sequence[Callback] = (),
) -> L.Trainer:
    """Build a trainer.

    Parameters
    ----------
    settings : TrainerConfig
        Settings that `check_trainer` accepts.
    epochs : int
        Maximum number of epochs where the settings have none.
    folder : Path
        Folder of the training.
    loggers : sequence of Logger
        Loggers of the training.
    callbacks : sequence of Callback
        All callbacks of the training.

    Raises
    ------
    UserError
        If Lightning refuses a setting, such as a device that the machine lacks.
    """
    devices = settings.devices
    few = settings.overfit_batches or None
    profiler = PROFILERS[settings.profiler](folder, "profile") if settings.profiler else None
    try:
        with quiet():
            return L.Trainer(
                default_root_dir=folder,
                accelerator=settings.accelerator,
                devices=int(devices) if isinstance(devices, str) else devices,
                precision=settings.precision,  # type: ignore[arg-type]
                max_epochs=settings.max_epochs or epochs,
                gradient_clip_val=settings.gradient_clip_val,
                fast_dev_run=settings.fast_dev_run,
                profiler=profiler,
                logger=list(loggers),
                callbacks=list(callbacks),
                num_sanity_val_steps=0,
                enable_progress_bar=False,
                enable_model_summary=False,
                log_every_n_steps=20,
                deterministic=torch.cuda.is_available(),
                # one process, also in a job of a batch system, whose tasks Lightning would count
                plugins=LightningEnvironment(),
                limit_train_batches=few,
                limit_val_batches=few,
            )
    except Exception as error:  # whatever Lightning and its devices refuse
        line = " ".join(str(error).split())
        raise UserError(
            f"trainer.accelerator={settings.accelerator} devices={devices} "
            f"precision={settings.precision}: {line}"
        ) from error


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress Lightning's messages about devices and numbers of workers."""
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
