"""Reading of the checkpoints of networks that Lightning trains, if they fit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch

from avn.core.errors import UserError
from avn.modules.network import Network


def read_checkpoint(path: Path, model: Network) -> dict[str, Any]:
    """Read a checkpoint of the model's own training.

    Raises
    ------
    UserError
        Where the file is missing, is no checkpoint, or belongs to another recipe.
    """
    checkpoint = _read(path, model, f"delete {path.parent} to train again")
    recipe = _flat(checkpoint["hyper_parameters"])
    for key, value in _flat(dict(model.hparams)).items():
        saved = recipe.get(key, "missing")
        if saved != value:
            raise UserError(
                f"{path}: checkpoint of another config ({model.node}.{key} is {saved} there, "
                f"{value} here); give the same value or train again"
            )
    return checkpoint


def check_start(path: Path, model: Network, epochs: int) -> None:
    """Check that a training of a model can go on from a checkpoint, which may be of another recipe.

    Parameters
    ----------
    path : Path
        The checkpoint.
    model : Network
        Network to be trained.
    epochs : int
        Maximum number of epochs.

    Raises
    ------
    UserError
        Where the file is missing or is no checkpoint, its weights are of another network, or it has
        as many epochs already.
    """
    checkpoint = _read(path, model, "give best.ckpt or last.ckpt of a training")
    wanted = {name: tuple(value.shape) for name, value in model.state_dict().items()}
    found = {name: tuple(value.shape) for name, value in checkpoint["state_dict"].items()}
    if differing := [name for name in (wanted | found) if wanted.get(name) != found.get(name)]:
        name = differing[0]
        raise UserError(
            f"ckpt_path: {path} is of another network than {model.node} ({name} is "
            f"{found.get(name, 'missing')} there, {wanted.get(name, 'missing')} here)"
        )
    trained = int(checkpoint["epoch"]) + 1
    if trained >= epochs:
        raise UserError(
            f"ckpt_path: {path} has {trained} epochs, and the training ends after {epochs}; give "
            f"more, such as trainer.max_epochs={trained + epochs}"
        )


def _read(path: Path, model: Network, advice: str) -> dict[str, Any]:
    try:
        checkpoint = torch.load(path, map_location="cpu", weights_only=True)
        complete = {"hyper_parameters", "state_dict", "epoch"} <= set(checkpoint)
        shaped = all(hasattr(value, "shape") for value in checkpoint["state_dict"].values())
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such checkpoint; {advice}") from error
    except Exception as error:  # whatever a damaged file makes the reader raise
        raise UserError(f"{path}: not a checkpoint of the {model.what}; {advice}") from error
    if not (complete and shaped):
        raise UserError(f"{path}: not a checkpoint of the {model.what}; {advice}")
    return dict(checkpoint)


def _flat(config: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in config.items():
        name = f"{prefix}{key}"
        flat |= _flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return flat
