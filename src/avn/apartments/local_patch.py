"""The local occupancy patch: the 5 x 5 cells in front of an agent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import STEPS, Grid, build_grid, squares_of

# Rows 1 to 5 ahead, columns -2 to 2 to the right.
WINDOW = 5
SIDE = WINDOW // 2


def window_offsets() -> NDArray[np.int32]:
    """Return the offsets of the window's cells, (5, 5, 2) int32: cells to the right and front.

    Row 0 is the nearest, column 0 the leftmost.
    """
    front, right = np.meshgrid(np.arange(1, WINDOW + 1), np.arange(-SIDE, SIDE + 1), indexing="ij")
    return np.stack((right, front), axis=-1).astype(np.int32)


def window_cells(grid: Grid) -> NDArray[np.int32]:
    """Find the free cells in the window of every state.

    Parameters
    ----------
    grid : Grid
        C free cells.

    Returns
    -------
    (4 C, 5, 5) int32
        Index of the cell, or -1 where the square is not free. Row r is r + 1 cells ahead, column
        c is c - 2 cells to the right. The state is 4 x cell + heading.
    """
    return _in_windows(grid.lattice, grid.lattice)


def window_rooms(plan: FloorPlan) -> NDArray[np.bool_]:
    """Find the squares of rooms in the window of every state.

    They are the squares inside the rooms and in the doorways, furnished or not; the others are
    those of walls, and those outside.

    Parameters
    ----------
    plan : FloorPlan
        Apartment with C free cells.

    Returns
    -------
    (4 C, 5, 5) bool
        By state, row and column, as in `window_cells`.
    """
    return _in_windows(build_grid(plan).lattice, squares_of(plan)[0]) >= 0


def _in_windows(lattice: NDArray[np.int32], squares: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the index in `squares` (S, 2), or -1, of each square in each window (4 C, 5, 5)."""
    offsets, both = window_offsets(), np.concatenate((lattice, squares))
    low = both.min(axis=0) - WINDOW
    number = np.full(np.ptp(both, axis=0) + 2 * WINDOW + 1, -1, dtype=np.int32)
    number[tuple((squares - low).T)] = np.arange(len(squares))
    ahead = STEPS[:, None, None] * offsets[..., 1:]
    aside = np.roll(STEPS, -1, axis=0)[:, None, None] * offsets[..., :1]
    seen = (lattice - low)[:, None, None, None] + ahead + aside
    return number[seen[..., 0], seen[..., 1]].reshape(-1, WINDOW, WINDOW)
