"""Exploration trajectories, which an agent follows before its episodes begin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.core.actions import FORWARD, HEADINGS, ROTATE_LEFT, ROTATE_RIGHT, transitions
from avn.core.random import scramble, uniform

# Probability of forward before the uniform choice among forward and the two rotations.
FORWARD_SHARE = 0.5
# Trajectories that are drawn before one is cut short instead.
TRIES = 16
EXPLORATIONS = ("shared", "own")


def explore(
    neighbours: NDArray[np.int32], keys: NDArray[np.uint64], steps: int
) -> NDArray[np.int64]:
    """Draw random walks through an apartment, with the policy of the paper's exploration.

    Each step is forward with probability 0.5, and otherwise forward, rotate right or rotate left
    with equal probability. A blocked move is drawn again, so that it becomes a turn to either side.
    The first state is uniform over all states.

    Parameters
    ----------
    neighbours : (C, 4) int
        The cell to the north, east, south and west, or -1.
    keys : (N,) uint64
        Key of the random numbers of each trajectory.
    steps : int
        Actions of each trajectory.

    Returns
    -------
    (N, steps + 1) int64
        States, including the first.
    """
    table = transitions(neighbours)
    free_ahead = (np.asarray(neighbours) >= 0).reshape(-1)
    draws = uniform(keys[:, None], np.arange(steps + 1)[None, :])
    trajectories = np.empty((len(keys), steps + 1), dtype=np.int64)
    trajectories[:, 0] = (draws[:, 0] * len(table)).astype(np.int64)
    turn_share = (1.0 - FORWARD_SHARE) / 3.0
    for step in range(1, steps + 1):
        state, draw = trajectories[:, step - 1], draws[:, step]
        # The draws below 2 * share are turns, those above are forward. At a wall the two turns
        # share the whole interval, which is equal to drawing again until a turn comes.
        share = np.where(free_ahead[state], turn_share, 0.5)
        turn = np.where(draw < share, ROTATE_LEFT, ROTATE_RIGHT)
        trajectories[:, step] = table[state, np.where(draw < 2 * share, turn, FORWARD)]
    return trajectories


def first_visits(trajectories: NDArray[np.int64], cells: int) -> NDArray[np.int64]:
    """Return the step at which each trajectory first visits each cell, (N, C); T for never."""
    count, length = trajectories.shape
    visits = np.full((count, cells), length, dtype=np.int64)
    trajectory, step = np.indices(trajectories.shape)
    np.minimum.at(visits, (trajectory, trajectories // HEADINGS), step)
    return visits


def shared_trajectory(
    neighbours: NDArray[np.int32],
    allowed: NDArray[np.bool_],
    key: np.uint64,
    steps: int,
    starts: int,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Draw one trajectory for all episodes of a scene, and the cells it leaves as starts.

    Parameters
    ----------
    neighbours : (C, 4) int
        The cell to the north, east, south and west, or -1.
    allowed : (K, C) bool
        Cells in which episodes of each source may begin.
    key : uint64
        Key of the random numbers.
    steps, starts : int
        Actions of the trajectory, and states that it has to leave for each source.

    Returns
    -------
    trajectory : (T,) int64
        States; T is `steps` + 1, or less if it was cut.
    left : (K, C) bool
        Allowed cells that the trajectory does not visit.
    """
    least = -(-starts // HEADINGS)
    trajectories, visits = _tries(neighbours, scramble(key, np.arange(TRIES)), steps)
    unvisited = (visits > steps)[:, None] & allowed
    # The first draw that leaves enough starts, or draw 0, which is then cut.
    chosen = int(np.argmax((unvisited.sum(axis=2) >= least).all(axis=1)))
    end = min(_last_step(visits[chosen], own, least) for own in allowed)
    return trajectories[chosen, :end], allowed & (visits[chosen] >= end)


def own_trajectories(
    neighbours: NDArray[np.int32], allowed: NDArray[np.bool_], keys: NDArray[np.uint64], steps: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Draw a trajectory for each of N episodes, and the cells it leaves as starts.

    Parameters
    ----------
    neighbours : (C, 4) int
        The cell to the north, east, south and west, or -1.
    allowed : (N, C) bool
        Cells in which each episode may begin.
    keys : (N,) uint64
        Key of the random numbers of each trajectory.
    steps : int
        Actions of each trajectory.

    Returns
    -------
    trajectories : (N, steps + 1) int64
        States; a trajectory that was cut repeats its last state.
    left : (N, C) bool
        Allowed cells that the trajectory does not visit.
    """
    count = len(keys)
    tries = scramble(keys[:, None], np.arange(TRIES)[None]).reshape(-1)
    trajectories, visits = (
        part.reshape(count, TRIES, -1) for part in _tries(neighbours, tries, steps)
    )
    chosen = ((visits > steps) & allowed[:, None]).any(axis=2).argmax(axis=1)
    trajectory, visit = trajectories[np.arange(count), chosen], visits[np.arange(count), chosen]
    ends = np.array([_last_step(v, own, 1) for v, own in zip(visit, allowed, strict=True)])
    kept = np.minimum(np.arange(steps + 1), ends[:, None] - 1)
    return np.take_along_axis(trajectory, kept, axis=1), allowed & (visit >= ends[:, None])


def _tries(
    neighbours: NDArray[np.int32], keys: NDArray[np.uint64], steps: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    trajectories = explore(neighbours, keys, steps)
    return trajectories, first_visits(trajectories, len(neighbours))


def _last_step(visits: NDArray[np.int64], allowed: NDArray[np.bool_], least: int) -> int:
    """Return the states of a trajectory that leaves `least` allowed cells unvisited."""
    return int(np.sort(visits[allowed])[-least])
