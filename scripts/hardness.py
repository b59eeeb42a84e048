"""Difficulty of an apartment: performance of a uniform random walk, and distances.

The figures are exact, not sampled. Under the protocol `var` the uniform walk draws from
forward, backward, rotate left and rotate right. Rotations are free, so only the axis of the
next attempted move matters: before a move the agent has turned by an even number of quarters
with probability p = 1/2 + (1 - p)/2, that is 2/3, and goes either way along its axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CELL, FloorPlan
from avn.apartments.grid import Grid, goal_cells, source_cells
from avn.apartments.surfaces import build_surfaces, line_of_sight

KEEPS_AXIS = 2 / 3
RECEIVER_HEIGHT, SOURCE_HEIGHT = 1.5, 1.0  # metres


@dataclass(frozen=True)
class Hardness:
    """Means over all starts outside the 3 x 3 cells around each source.

    Attributes
    ----------
    success, spl : float
        Of the uniform random walk under the protocol `var`, 0 to 1.
    other_room : float
        Share of starts in another room than the source.
    out_of_sight : float
        Share of starts without a line of sight from the receiver (1.5 m) to the source (1.0 m).
    detour : float
        Mean ratio of geodesic to Euclidean distance.
    """

    success: float
    spl: float
    other_room: float
    out_of_sight: float
    detour: float


def random_walk_odds(
    grid: Grid, source: int, cap: str = "source"
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Compute success and SPL of the uniform random walk from every cell to one source.

    An episode ends after twice as many attempted moves as the source cell is away, or the nearest
    goal cell with `cap="goal"`; p is the number of attempted moves and l that of the shortest walk
    to the goal cells.

    Parameters
    ----------
    grid : Grid
        Cells of the apartment.
    source : int
        Cell of the source.
    cap : {"source", "goal"}
        As `protocol.cap`.

    Returns
    -------
    success, spl : (C,) float64
        Means over the four headings of a start.
    start : (C,) bool
        Cells that are starts: those outside the goal.
    """
    goal = goal_cells(grid)[source]
    here = np.arange(grid.cells)
    # Where the two moves along each axis end; a blocked one stays.
    landing = np.where(grid.neighbours >= 0, grid.neighbours, here[:, None])
    ways = (landing[:, (0, 2)], landing[:, (1, 3)])
    shortest = grid.distances[:, goal].min(axis=1).astype(int)
    limit = 2 * (shortest if cap == "goal" else grid.distances[:, source].astype(int))
    success, spl = np.zeros(grid.cells), np.zeros(grid.cells)
    # first[a, c]: odds that the k-th move, made along axis a from cell c, is the first to
    # enter the goal.
    first = np.stack([goal[way].mean(axis=1) for way in ways])
    for step in range(1, int(limit.max()) + 1):
        odds = np.where(step <= limit, first.mean(axis=0), 0.0)
        success += odds
        spl += odds * shortest / np.maximum(step, shortest)
        next_axis = KEEPS_AXIS * first + (1 - KEEPS_AXIS) * first[::-1]
        next_axis[:, goal] = 0.0
        first = np.stack([next_axis[a][way].mean(axis=1) for a, way in enumerate(ways)])
    return success, spl, ~goal


def hardness(plan: FloorPlan, grid: Grid) -> Hardness:
    """Measure an apartment over every source and start; see `Hardness`."""
    surfaces = build_surfaces(plan)
    receivers = np.column_stack([grid.centres, np.full(grid.cells, RECEIVER_HEIGHT)])
    rows = []
    for source in source_cells(plan, grid):
        success, spl, start = random_walk_odds(grid, int(source))
        position = np.broadcast_to([*grid.centres[source], SOURCE_HEIGHT], receivers.shape)
        hidden = ~line_of_sight(surfaces, position, receivers)
        away = grid.rooms != grid.rooms[source]
        straight = np.hypot(*(grid.centres - grid.centres[source]).T)
        with np.errstate(invalid="ignore", divide="ignore"):
            detour = grid.distances[:, source] * CELL / straight
        rows.append(np.stack([success, spl, away, hidden, detour])[:, start])
    return Hardness(*(float(value) for value in np.concatenate(rows, axis=1).mean(axis=1)))
