"""The exploration walk: where an agent that explores has been before its episode begins."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.core.actions import FORWARD, HEADINGS, ROTATE_LEFT, ROTATE_RIGHT, transitions
from avn.core.random import scramble, uniform

FORWARD_SHARE = 0.5
# Draws of a walk before it is cut short instead.
TRIES = 16
EXPLORATIONS = ("shared", "own")


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


def shared_walk(
    neighbours: NDArray[np.int32],
    allowed: NDArray[np.bool_],
    key: np.uint64,
    steps: int,
    starts: int,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """One walk for all episodes of a room, and which cells it leaves as starts.

    Parameters
    ----------
    neighbours : (C, 4) int
    allowed : (K, C) bool
        Where episodes of each source could begin.
    key : uint64
    steps, starts : int
        Length of the walk, and how many states it has to leave for each source.

    Returns
    -------
    walk : (T,) int64
        States; T is `steps` + 1, or less where it was cut short.
    left : (K, C) bool
    """
    least = -(-starts // HEADINGS)
    walks, visits = _tries(neighbours, scramble(key, np.arange(TRIES)), steps)
    unvisited = (visits > steps)[:, None] & allowed
    # The first try that leaves enough, or try 0, which is then cut.
    chosen = int(np.argmax((unvisited.sum(axis=2) >= least).all(axis=1)))
    end = min(_last_step(visits[chosen], own, least) for own in allowed)
    return walks[chosen, :end], allowed & (visits[chosen] >= end)


def own_walks(
    neighbours: NDArray[np.int32], allowed: NDArray[np.bool_], keys: NDArray[np.uint64], steps: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """A walk for each of N episodes, and which cells it leaves as starts.

    Parameters
    ----------
    neighbours : (C, 4) int
    allowed : (N, C) bool
        Where each episode could begin.
    keys : (N,) uint64
    steps : int

    Returns
    -------
    walks : (N, steps + 1) int64
        States; a walk that was cut short stays where it ended.
    left : (N, C) bool
    """
    count = len(keys)
    tries = scramble(keys[:, None], np.arange(TRIES)[None]).reshape(-1)
    walks, visits = (part.reshape(count, TRIES, -1) for part in _tries(neighbours, tries, steps))
    chosen = ((visits > steps) & allowed[:, None]).any(axis=2).argmax(axis=1)
    walk, visit = walks[np.arange(count), chosen], visits[np.arange(count), chosen]
    ends = np.array([_last_step(v, own, 1) for v, own in zip(visit, allowed, strict=True)])
    kept = np.minimum(np.arange(steps + 1), ends[:, None] - 1)
    return np.take_along_axis(walk, kept, axis=1), allowed & (visit >= ends[:, None])


def _tries(
    neighbours: NDArray[np.int32], keys: NDArray[np.uint64], steps: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    walks = explore(neighbours, keys, steps)
    return walks, first_visits(walks, len(neighbours))


def _last_step(visits: NDArray[np.int64], allowed: NDArray[np.bool_], least: int) -> int:
    """Steps that a walk may have to leave so many allowed cells unvisited."""
    return int(np.sort(visits[allowed])[-least])
