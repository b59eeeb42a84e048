"""Spaces of Gymnasium for the observations and actions of an environment, and their arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray

from avn.rl.environment import NavigationEnv
from avn.rl.observation_specs import spec_of

Observation = dict[str, NDArray[Any]]


def arrays(env: NavigationEnv) -> Observation:
    """Return the observations of all agents by name, each (N, ...)."""
    return {name: value.numpy() for name, value in env.shown().items()}


def observation_space(env: NavigationEnv) -> spaces.Dict:
    """Return the observation space of one agent; its bounds depend on the names alone."""
    boxes: dict[str, spaces.Space[Any]] = {}
    for name, values in env.shown().items():
        spec, dtype = spec_of(name), values.numpy().dtype.type
        boxes[name] = spaces.Box(dtype(spec.low), dtype(spec.high), values.shape[1:], dtype)
    return spaces.Dict(boxes)


def as_actions(actions: Any, n: int, count: int) -> torch.Tensor:
    """Convert actions of a user to an (N,) int64 tensor.

    Parameters
    ----------
    actions : array_like of int
        One action for each of N agents.
    n : int
        N.
    count : int
        Number of actions.

    Raises
    ------
    ValueError
        If they are not N integers from 0 to count - 1.
    """
    found = np.asarray(actions)
    if found.dtype.kind not in "iu" or found.shape != (n,):
        shown = found.size <= 8 and found.ndim <= 1
        what = str(found.tolist()) if shown else f"{found.dtype} values of shape {found.shape}"
        wanted = f"{n} integers" if n > 1 else "an integer"
        raise ValueError(f"action: {what}; give {wanted} from 0 to {count - 1}")
    wrong = found[(found < 0) | (found >= count)]
    if wrong.size:
        raise ValueError(f"action: {wrong[0]} is out of range; give 0 to {count - 1}")
    return torch.from_numpy(found.astype(np.int64))
