"""The local occupancy patch: the 5 x 5 cells in front of an agent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.grid import STEPS, Grid

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
    lattice, offsets = grid.lattice, window_offsets()
    low = lattice.min(axis=0) - WINDOW
    number = np.full(np.ptp(lattice, axis=0) + 2 * WINDOW + 1, -1, dtype=np.int32)
    number[tuple((lattice - low).T)] = np.arange(len(lattice))
    ahead = STEPS[:, None, None] * offsets[..., 1:]
    aside = np.roll(STEPS, -1, axis=0)[:, None, None] * offsets[..., :1]
    squares = (lattice - low)[:, None, None, None] + ahead + aside
    return number[squares[..., 0], squares[..., 1]].reshape(-1, WINDOW, WINDOW)
