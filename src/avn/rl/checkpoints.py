"""Checkpoints of actor-critics: of the best network, and of the last round of a training."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import torch

from avn.core.errors import UserError
from avn.rl.algorithm import Algorithm
from avn.rl.networks import ActorCritic

LAST, BEST, CURVE = "last.ckpt", "best.ckpt", "curve.json"


def read_start(path: Path, recipe: Algorithm) -> dict[str, Any]:
    """Read the last checkpoint of a training from which another one is to go on.

    Parameters
    ----------
    path : Path
        Checkpoint of the former training.
    recipe : Algorithm
        Settings of the new one.

    Returns
    -------
    dict
        `weights`, `moments` and number of `updates`.

    Raises
    ------
    UserError
        If it is no such checkpoint, or has as many actions as the new training shall have.
    """
    try:
        kept = torch.load(path, weights_only=True)
        found = {name: kept[name] for name in ("weights", "moments", "updates")}
        steps = found["updates"] // recipe.updates_per_batch * recipe.batch
    except Exception as error:  # whatever a damaged or other file makes the reader raise
        raise UserError(
            f"ckpt_path: {path} is no last checkpoint of an actor-critic; give the "
            f"{LAST} of a training"
        ) from error
    if steps + recipe.batch * recipe.workers > recipe.total_steps:
        raise UserError(
            f"ckpt_path: {path} has {steps} actions, and the training ends after "
            f"{recipe.total_steps}; give more algorithm.total_steps"
        )
    return found


def save_network(network: ActorCritic, fingerprint: str) -> dict[str, Any]:
    """Return the content of a checkpoint of a network alone."""
    weights = {name: value.clone() for name, value in network.state_dict().items()}
    network_spec = dataclasses.asdict(network.spec)
    return {"fingerprint": fingerprint, "network_spec": network_spec, "network": weights}


def load_network(network: ActorCritic, path: Path, fingerprint: str) -> None:
    """Load the weights of a checkpoint into a network.

    Parameters
    ----------
    network : ActorCritic
        Changed in place.
    path : Path
        Checkpoint of `save_network`.
    fingerprint : str
        Expected fingerprint of the checkpoint.

    Raises
    ------
    UserError
        If the checkpoint is missing, damaged or of another training.
    """
    kept = read_checkpoint(path, fingerprint)
    try:
        if kept["network_spec"] != dataclasses.asdict(network.spec):
            raise UserError(
                f"{path}: features or sizes are {kept['network_spec']}, and the config's are "
                f"{dataclasses.asdict(network.spec)}; delete {path.parent} to train again"
            )
        network.load_state_dict(kept["network"])
    except (KeyError, RuntimeError, TypeError) as error:
        raise damaged(path) from error


def read_checkpoint(path: Path, fingerprint: str) -> dict[str, Any]:
    """Read the content of a checkpoint.

    Raises
    ------
    UserError
        If it is missing, damaged or of another training.
    """
    try:
        kept: dict[str, Any] = torch.load(path, weights_only=True)
        found = kept["fingerprint"]
    except Exception as error:
        raise damaged(path) from error
    if found != fingerprint:
        raise UserError(
            f"{path}: the checkpoint is of another row or recipe ({str(found)[:8]}, not "
            f"{fingerprint[:8]}); delete {path.parent} to train again"
        )
    return kept


def damaged(path: Path) -> UserError:
    """Return the error for a damaged checkpoint."""
    return UserError(f"{path}: damaged; delete {path.parent} to train again")
