"""The exploration walk: where an agent that explores has been before its episode begins."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.navigation.actions import FORWARD, HEADINGS, ROTATE_LEFT, ROTATE_RIGHT, transitions
from avn.navigation.hashing import uniform

FORWARD_SHARE = 0.5


def explore(
    neighbours: NDArray[np.int32], keys: NDArray[np.uint64], steps: int
) -> NDArray[np.int64]:
    """Random walks through an apartment, as the paper's authors let their agent explore.

    At each step forward with a chance of 0.5, else one of forward, rotate right and rotate left; a
    blocked move is drawn again, so that at a wall it becomes a turn to either side. The walk
    begins at any state.

    Parameters
    ----------
    neighbours : (C, 4) int
    keys : (N,) uint64
        One stream of random numbers for each walk.
    steps : int

    Returns
    -------
    (N, steps + 1) int64
        States, the first one included.
    """
    table = transitions(neighbours)
    free_ahead = (np.asarray(neighbours) >= 0).reshape(-1)
    draws = uniform(keys[:, None], np.arange(steps + 1)[None, :])
    walks = np.empty((len(keys), steps + 1), dtype=np.int64)
    walks[:, 0] = (draws[:, 0] * len(table)).astype(np.int64)
    turn_share = (1.0 - FORWARD_SHARE) / 3.0
    for step in range(1, steps + 1):
        state, draw = walks[:, step - 1], draws[:, step]
        # Two shares of turning lie at the low end; a draw above them is forward. At a wall the
        # draw is stretched over the two turns alone, which is drawing until one of them comes.
        share = np.where(free_ahead[state], turn_share, 0.5)
        turn = np.where(draw < share, ROTATE_LEFT, ROTATE_RIGHT)
        walks[:, step] = table[state, np.where(draw < 2 * share, turn, FORWARD)]
    return walks


def first_visits(walks: NDArray[np.int64], cells: int) -> NDArray[np.int64]:
    """The step at which each walk first stands on each cell, (N, C); `steps + 1` for never."""
    count, length = walks.shape
    visits = np.full((count, cells), length, dtype=np.int64)
    walk, step = np.indices(walks.shape)
    np.minimum.at(visits, (walk, walks // HEADINGS), step)
    return visits
