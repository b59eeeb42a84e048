"""Protocol of the scenes that the simulator runs in, and scenes drawn as text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from avn.apartments.grid import STEPS, Grid, moves_between
from avn.core.errors import UserError


class NavigationScene(Protocol):
    """Apartment in which agents move; `avn.dataset.scene.Scene` implements it."""

    @property
    def name(self) -> str:
        """Name of the apartment."""

    @property
    def grid(self) -> Grid:
        """Cells with their neighbours, distances and rooms."""

    @property
    def sources(self) -> NDArray[np.int32]:
        """Cells of the K sources, (K,) int32."""

    @property
    def in_sight(self) -> NDArray[np.bool_]:
        """True if the source is in sight from the cell, (K, C) bool."""


@dataclass(frozen=True)
class DrawnScene:
    """Scene that was drawn as text; see `draw`.

    Attributes
    ----------
    name : str
        Name of the scene.
    grid : Grid
        Cells with their neighbours, distances and rooms.
    sources : (K,) int32
        Cells of the sources.
    in_sight : (K, C) bool
        True if the source is in sight from the cell.
    """

    name: str
    grid: Grid
    sources: NDArray[np.int32]
    in_sight: NDArray[np.bool_]


def draw(name: str, drawing: str) -> DrawnScene:
    """Make a scene from text, for tests of agents on a few cells.

    Every character is a square of 0.5 m, and the first line lies in the north. `a`, `b`, ... are
    free cells of the first, second, ... room, capitals are free cells with a source, and all other
    characters are blocked squares.

    Parameters
    ----------
    name : str
        Name of the scene.
    drawing : str
        Lines of characters.

    Returns
    -------
    DrawnScene

    Raises
    ------
    UserError
        If there is no source, or the free cells are not connected.
    """
    rows = [line.strip() for line in drawing.strip().splitlines()][::-1]
    free = [(x, y) for y, row in enumerate(rows) for x, mark in enumerate(row) if mark.isalpha()]
    marks = [rows[y][x] for x, y in free]
    sources = np.array([i for i, mark in enumerate(marks) if mark.isupper()], dtype=np.int32)
    if not len(sources):
        raise UserError(f"{name}: the drawing has no source; write one cell as a capital letter")
    number = {cell: i for i, cell in enumerate(free)}
    neighbours = np.array(
        [[number.get((x + dx, y + dy), -1) for dx, dy in STEPS] for x, y in free], dtype=np.int32
    )
    grid = Grid(
        lattice=np.array(free, dtype=np.int32),
        neighbours=neighbours,
        distances=_distances(name, neighbours),
        rooms=np.array([ord(mark.lower()) - ord("a") for mark in marks], dtype=np.int16),
        squares=len(free),
    )
    return DrawnScene(name, grid, sources, _in_sight(grid, sources))


def _distances(name: str, neighbours: NDArray[np.int32]) -> NDArray[np.int16]:
    moves = moves_between(neighbours)
    if not np.isfinite(moves).all():
        raise UserError(f"{name}: some free cells cannot be reached; join them in the drawing")
    return moves.astype(np.int16)


def _in_sight(grid: Grid, sources: NDArray[np.int32], samples: int = 65) -> NDArray[np.bool_]:
    """Return True if the line from source to cell stays on free squares, (K, C) bool."""
    low = grid.lattice.min(axis=0) - 1
    free = np.zeros(grid.lattice.max(axis=0) - low + 2, dtype=bool)
    free[tuple((grid.lattice - low).T)] = True
    along = np.linspace(0.0, 1.0, samples)[:, None]
    begin = grid.lattice[sources][:, None, None]
    end = grid.lattice[None, :, None]
    squares = np.rint(begin + along * (end - begin)).astype(int) - low
    seen: NDArray[np.bool_] = free[squares[..., 0], squares[..., 1]].all(axis=-1)
    return seen
