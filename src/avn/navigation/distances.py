"""Distances of an apartment under a protocol, and the fewest actions to the goal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from avn.apartments.floor_plan import CELL
from avn.apartments.grid import Grid
from avn.core.actions import HEADINGS, STOP, transitions
from avn.navigation.navigation_scene import NavigationScene
from avn.navigation.protocols import Protocol

# More than the cost of any path, and low enough that sums stay within int16.
UNREACHABLE = 10_000


@dataclass(frozen=True)
class Distances:
    """Distances of K sources to C cells under one protocol.

    Attributes
    ----------
    goal : (K, C) bool
        Cells in which an agent succeeds.
    source_moves : (K, C) int64
        Moves of the shortest path to the source cell.
    shortest : (K, C) float64
        The l of SPL, in moves or metres as the protocol says.
    most_moves : (K, C) int64
        Attempted moves that end an episode which starts in the cell; see `Protocol.most_moves`.
    allowance : (K, C) int64
        Largest number of moves of a path with p <= l that ends within the limit.
    crossings : (K, C) int64
        Least number of room borders on a shortest path to the source.
    """

    goal: NDArray[np.bool_]
    source_moves: NDArray[np.int64]
    shortest: NDArray[np.float64]
    most_moves: NDArray[np.int64]
    allowance: NDArray[np.int64]
    crossings: NDArray[np.int64]


def measure(
    scene: NavigationScene, protocol: Protocol, places: NDArray[np.int32] | None = None
) -> Distances:
    """Compute the distances of a scene under a protocol.

    Parameters
    ----------
    scene : NavigationScene
        Apartment.
    protocol : Protocol
        Defines the goal cells and the unit of path length.
    places : (K,) int, optional
        Cells of the sources; those of the scene by default.
    """
    grid, sources = scene.grid, np.asarray(scene.sources if places is None else places)
    goal = protocol.goal_cells(grid, sources)
    source_moves = grid.distances[sources].astype(np.int64)
    goal_moves = _moves_to(goal, grid)
    if protocol.path_length == "metres":
        best, shortest = source_moves, CELL * source_moves.astype(np.float64)
    else:
        best, shortest = goal_moves, goal_moves.astype(np.float64)
    capped = goal_moves if protocol.cap == "goal" else source_moves
    most_moves: NDArray[np.int64] = protocol.most_moves(torch.from_numpy(capped)).numpy()
    # A move that reaches the limit ends the episode, so that no Stop can follow it.
    allowance = np.maximum(goal_moves, np.minimum(best, most_moves - protocol.requires_stop))
    crossings = _crossings(grid, source_moves)
    return Distances(goal, source_moves, shortest, most_moves, allowance, crossings)


def _moves_to(goal: NDArray[np.bool_], grid: Grid) -> NDArray[np.int64]:
    """Return the moves to the nearest goal cell, (K, C)."""
    nearest = [grid.distances[cells].min(axis=0) for cells in goal]
    return np.stack(nearest).astype(np.int64)


def _crossings(grid: Grid, moves: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the least room borders on a shortest path, (K, C), by distance from the source."""
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
    """Compute the fewest moves and rotations to the goal with a limited number of moves.

    `actions_to_cells` has no such limit.

    The agent moves forward or backward and turns by quarters, each of which is one action. The
    limit excludes longer paths that save turns. The method is dynamic programming over the moves
    that are left: at a cell the agent turns to one of four headings, which takes at most two
    actions, and then moves.

    Parameters
    ----------
    neighbours : (C, 4) int
        The cell to the north, east, south and west, or -1.
    goal : (K, C) bool
        Goal cells of each source.
    moves : int
        Largest number of moves in the table.

    Returns
    -------
    (moves + 1, K, 4 C) int16
        Actions by moves left, source and state; `UNREACHABLE` or more if the goal is farther.
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


def actions_to_cells(neighbours: NDArray[np.int32], cells: NDArray[np.int32]) -> NDArray[np.int64]:
    """Compute the fewest moves and rotations to K cells, in any heading at the end.

    Parameters
    ----------
    neighbours : (C, 4) int
        The cell to the north, east, south and west, or -1.
    cells : (K,) int
        Cells to reach.

    Returns
    -------
    (K, 4 C) int64
        Actions by cell to reach and state.
    """
    following = transitions(neighbours)[:, :STOP]
    states = len(following)
    before = np.repeat(np.arange(states), STOP)
    # from the state after an action to the one before it; cells to reach are joined by their states
    backward = coo_matrix(
        (np.ones(before.size), (following.reshape(-1), before)), shape=(states, states)
    ).tocsr()
    ends = HEADINGS * np.asarray(cells)[:, None] + np.arange(HEADINGS)
    nearest = [dijkstra(backward, indices=own, unweighted=True, min_only=True) for own in ends]
    return np.stack(nearest).astype(np.int64)
