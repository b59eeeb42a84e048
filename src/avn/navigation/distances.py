"""Tables of an apartment under a protocol: how far it is, and what the best walk costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CELL
from avn.apartments.grid import Grid
from avn.core.actions import HEADINGS
from avn.navigation.place import Place
from avn.navigation.protocols import Protocol

# More than any walk costs, and far enough below the limit of int16 to add to.
UNREACHABLE = 10_000


@dataclass(frozen=True)
class Distances:
    """Distances of K sources to C cells under one protocol.

    Attributes
    ----------
    goal : (K, C) bool
        Where an agent succeeds.
    source_moves : (K, C) int64
        Moves of the shortest walk to the source cell.
    shortest : (K, C) float64
        The l of SPL, in the protocol's unit.
    allowance : (K, C) int64
        Moves that a walk may take and still have p <= l.
    crossings : (K, C) int64
        Least number of borders between rooms on a shortest walk to the source.
    """

    goal: NDArray[np.bool_]
    source_moves: NDArray[np.int64]
    shortest: NDArray[np.float64]
    allowance: NDArray[np.int64]
    crossings: NDArray[np.int64]


def measure(place: Place, protocol: Protocol) -> Distances:
    """The distances of a place under a protocol."""
    grid, sources = place.grid, np.asarray(place.sources)
    goal = protocol.goal_cells(grid, sources)
    source_moves = grid.distances[sources].astype(np.int64)
    if protocol.path_length == "metres":
        allowance = source_moves
        shortest = CELL * source_moves.astype(np.float64)
    else:
        allowance = _moves_to(goal, grid)
        shortest = allowance.astype(np.float64)
    return Distances(goal, source_moves, shortest, allowance, _crossings(grid, source_moves))


def _moves_to(goal: NDArray[np.bool_], grid: Grid) -> NDArray[np.int64]:
    """Moves to the nearest goal cell, (K, C)."""
    nearest = [grid.distances[cells].min(axis=0) for cells in goal]
    return np.stack(nearest).astype(np.int64)


def _crossings(grid: Grid, moves: NDArray[np.int64]) -> NDArray[np.int64]:
    """Least borders between rooms on a shortest walk, (K, C), ring by ring from the source."""
    neighbours = grid.neighbours
    closer = (neighbours >= 0) & (moves[:, neighbours] == moves[:, :, None] - 1)
    border = (grid.rooms[neighbours] != grid.rooms[:, None]).astype(np.int64)
    crossings = np.zeros_like(moves)
    for ring in range(1, int(moves.max()) + 1):
        there = np.where(closer, crossings[:, neighbours] + border, UNREACHABLE).min(axis=-1)
        crossings = np.where(moves == ring, there, crossings)
    return crossings


def fewest_actions(
    neighbours: NDArray[np.int32], goal: NDArray[np.bool_], moves: int
) -> NDArray[np.int16]:
    """Fewest moves and rotations to the goal, on a walk of at most so many moves.

    The agent moves forward or backward and turns by quarters, each of which is one action. The
    limit on moves keeps a walk from going a longer way round to save turns. Dynamic programming
    over the moves that are left: at a cell the agent turns to one of four headings, which takes at
    most two actions, and then moves.

    Parameters
    ----------
    neighbours : (C, 4) int
        The cell to the north, east, south and west, or -1.
    goal : (K, C) bool
    moves : int
        The largest number of moves that is asked for.

    Returns
    -------
    (moves + 1, K, 4 C) int16
        By moves left, goal and state; `UNREACHABLE` or more where the goal is farther.
    """
    sources, cells = goal.shape
    ahead = np.where(neighbours >= 0, neighbours, cells)
    behind = np.roll(ahead, 2, axis=1)
    turns = np.abs(np.arange(HEADINGS)[:, None] - np.arange(HEADINGS)[None, :])
    turns = np.minimum(turns, HEADINGS - turns).astype(np.int16)
    heading = np.arange(HEADINGS)
    costs = np.full((moves + 1, sources, cells, HEADINGS), UNREACHABLE, dtype=np.int16)
    costs[:, goal] = 0
    # One more cell stands for every wall, so that a blocked move never pays.
    padded = np.full((sources, cells + 1, HEADINGS), UNREACHABLE, dtype=np.int16)
    for left in range(1, moves + 1):
        padded[:, :cells] = costs[left - 1]
        moved = 1 + np.minimum(padded[:, ahead, heading], padded[:, behind, heading])
        turned = (moved[:, :, None, :] + turns).min(axis=-1)
        costs[left] = np.minimum(costs[left], turned)
    return costs.reshape(moves + 1, sources, cells * HEADINGS)
