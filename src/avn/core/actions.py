"""Actions, headings and states as integers, and the transitions between states."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

FORWARD, BACKWARD, ROTATE_LEFT, ROTATE_RIGHT, STOP = range(5)
MOVES = (FORWARD, BACKWARD)
ACTIONS = 5
HEADINGS = 4


def transitions(neighbours: NDArray[np.int32]) -> NDArray[np.int64]:
    """Compute the next state of each state and action; a blocked move keeps the state.

    Parameters
    ----------
    neighbours : (C, 4) int
        Index of the cell to the north, east, south and west, or -1.

    Returns
    -------
    (4 C, 5) int64
        By state (4 x cell + heading) and action. Backward keeps the heading.
    """
    cells = len(neighbours)
    cell = np.arange(cells)[:, None]
    heading = np.arange(HEADINGS)[None, :]
    reached = np.where(neighbours >= 0, neighbours, cell).astype(np.int64)
    behind = reached[:, (np.arange(HEADINGS) + 2) % HEADINGS]
    table = np.stack(
        (
            HEADINGS * reached + heading,
            HEADINGS * behind + heading,
            HEADINGS * cell + (heading - 1) % HEADINGS,
            HEADINGS * cell + (heading + 1) % HEADINGS,
            HEADINGS * cell + heading,
        ),
        axis=-1,
    )
    return table.reshape(HEADINGS * cells, ACTIONS)


def action_error(actions: object, n: int, count: int, protocol: str) -> str | None:
    """Describe what is wrong with the actions of N agents.

    Parameters
    ----------
    actions : object
        Actions as an agent or a user gave them.
    n : int
        N, number of agents.
    count : int
        Number of actions; they are numbered from 0.
    protocol : str
        Name of the protocol, for the message.

    Returns
    -------
    str or None
        Clause of a message; None if they are an (N,) int64 tensor on the CPU, each 0 to count - 1.
    """
    wanted = f"wanted an int64 tensor of shape ({n},) on the CPU with actions 0 to {count - 1}"
    if not isinstance(actions, Tensor):
        return f"the actions are a {type(actions).__name__}; {wanted}"
    if actions.dtype != torch.int64 or tuple(actions.shape) != (n,) or actions.device.type != "cpu":
        kind = f"{str(actions.dtype).removeprefix('torch.')} tensor of shape {tuple(actions.shape)}"
        return f"the actions are a {kind} on {actions.device}; {wanted}"
    if not n:
        return None
    low, high = (int(end) for end in torch.aminmax(actions))
    if low >= 0 and high < count:
        return None
    action = low if low < 0 else high
    what = "Stop is not an action" if action == STOP else f"{action} is no action"
    return f"{what} under protocol '{protocol}', whose actions are 0 to {count - 1}"
