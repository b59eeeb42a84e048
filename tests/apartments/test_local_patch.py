"""The local patch: cells ahead that are free, and cells that are part of a room."""

from __future__ import annotations

import numpy as np

from avn.apartments.grid import build_grid, squares_of
from avn.apartments.local_patch import window_cells, window_rooms
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import load_split
from avn.apartments.walls import walls

PLAN = load_split(SplitConfig(name="mini", folder="mini"))["test"][0]
# Row and column of a window as squares to the front and to the right; north, east, south, west.
AHEAD = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])


def test_free_cells_are_in_rooms_and_walls_are_not() -> None:
    grid = build_grid(PLAN)
    rooms, free = window_rooms(PLAN), window_cells(grid) >= 0
    assert rooms.shape == free.shape == (4 * grid.cells, 5, 5)
    assert not (free & ~rooms).any()
    assert (rooms & ~free).any(), "furniture"
    blocks = walls(PLAN)
    indoors = {tuple(square) for square in squares_of(PLAN)[0]}
    for state in range(0, 4 * grid.cells, 37):
        ahead = AHEAD[state % 4]
        right = AHEAD[(state % 4 + 1) % 4]
        for row in range(5):
            for column in range(5):
                square = grid.lattice[state // 4] + (row + 1) * ahead + (column - 2) * right
                assert rooms[state, row, column] == (tuple(square) in indoors)
                x, y = square * 0.5
                in_wall = (
                    (blocks[:, 0] <= x)
                    & (x <= blocks[:, 2])
                    & (blocks[:, 1] <= y)
                    & (y <= blocks[:, 3])
                ).any()
                assert not (in_wall and rooms[state, row, column])
