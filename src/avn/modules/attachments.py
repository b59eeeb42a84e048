"""Loggers and callbacks of a training, from the config groups `logger` and `callbacks`."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import lightning as L
from lightning.pytorch.callbacks import Callback
from lightning.pytorch.loggers import Logger, TensorBoardLogger

from avn.core.classes import import_class
from avn.core.errors import UserError

if TYPE_CHECKING:
    from torch.utils.tensorboard import SummaryWriter

_TARGET = "_target_"
# Packages that loggers need, which are extras of this one, by the name of the class.
_EXTRAS = {"WandbLogger": "wandb", "MLFlowLogger": "mlflow"}


def build_loggers(
    nodes: Mapping[str, Any], folder: Path, run_name: str, step: int = 0
) -> list[Logger]:
    """Build the loggers of a training.

    Parameters
    ----------
    nodes : mapping of str to dict
        Settings of each logger by name, with `_target_`. In their texts `{folder}` stands for the
        folder of the training, `{id}` for its name and `{run}` for the name of the run.
    folder : Path
        Folder of the training.
    run_name : str
        Name of the run.
    step : int
        First step of a resumed training: TensorBoard then hides what was logged from there on
        before the interruption.

    Raises
    ------
    UserError
        If a logger cannot be built, for instance because its package is not installed.
    """
    words = {"{folder}": str(folder), "{id}": folder.name, "{run}": run_name}
    built = []
    for name, node in nodes.items():
        cls, settings = _checked("logger", name, node, Logger)
        if step and issubclass(cls, TensorBoardLogger):
            settings.setdefault("purge_step", step)
        built.append(_built(f"logger.{name}", cls, _filled(settings, words)))
    return built


def build_callbacks(nodes: Mapping[str, Any], folder: Path) -> list[Callback]:
    """Build the further callbacks of a training.

    Parameters
    ----------
    nodes : mapping of str to dict
        Settings of each callback by name, with `_target_`. In their texts `{folder}` stands for
        the folder of the training.
    folder : Path
        Folder of the training.

    Raises
    ------
    UserError
        If a callback cannot be built.
    """
    words = {"{folder}": str(folder)}
    return [
        _built(f"callbacks.{name}", cls, _filled(settings, words))
        for name, node in nodes.items()
        for cls, settings in [_checked("callbacks", name, node, Callback)]
    ]


def check_attachments(loggers: Mapping[str, Any], callbacks: Mapping[str, Any]) -> None:
    """Raise `UserError` for a logger or callback whose class or settings do not exist."""
    for name, node in loggers.items():
        _checked("logger", name, node, Logger)
    for name, node in callbacks.items():
        _checked("callbacks", name, node, Callback)


def tensorboard_writer(trainer: L.Trainer) -> SummaryWriter | None:
    """Return the writer of a trainer's TensorBoard events, None if it writes none."""
    for logger in trainer.loggers:
        if isinstance(logger, TensorBoardLogger):
            return logger.experiment  # type: ignore[no-any-return]
    return None


def _checked(group: str, name: str, node: Any, base: type) -> tuple[Any, dict[str, Any]]:
    """Return the class and the settings of an entry; refuse what the class does not take."""
    key = f"{group}.{name}"
    if not isinstance(node, Mapping) or not isinstance(node.get(_TARGET), str):
        raise UserError(f"{key}: has no {_TARGET}; name a class, such as {base.__module__}")
    cls = import_class(f"{key}.{_TARGET}", node[_TARGET])
    if not (isinstance(cls, type) and issubclass(cls, base)):
        raise UserError(
            f"{key}.{_TARGET}: '{node[_TARGET]}' is no {base.__name__} of Lightning; derive it "
            f"from {base.__module__}.{base.__name__}"
        )
    extra = _EXTRAS.get(cls.__name__)
    if extra and find_spec(extra) is None:
        raise UserError(f"{key}: package {extra} is missing; pip install 'avn[{extra}]'")
    settings = {key: value for key, value in node.items() if key != _TARGET}
    taken = inspect.signature(cls).parameters
    known = [own.name for own in taken.values() if own.kind is not own.VAR_KEYWORD]
    unknown = sorted(set(settings) - set(known))
    if unknown and len(known) == len(taken):
        raise UserError(f"{key}.{unknown[0]}: no such setting; there are {', '.join(known)}")
    return cls, settings


def _filled(value: Any, words: Mapping[str, str]) -> Any:
    """Replace the placeholders in all texts of a value."""
    if isinstance(value, str):
        for placeholder, text in words.items():
            value = value.replace(placeholder, text)
    elif isinstance(value, Mapping):
        value = {key: _filled(child, words) for key, child in value.items()}
    elif isinstance(value, list):
        value = [_filled(child, words) for child in value]
    return value


def _built(key: str, cls: Any, settings: dict[str, Any]) -> Any:
    try:
        return cls(**settings)
    except Exception as error:  # whatever a class of another package refuses
        line = " ".join(str(error).split())
        raise UserError(f"{key}: {cls.__name__} refuses its settings ({line})") from error
