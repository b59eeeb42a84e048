import numpy as np
import pytest

from avn.core.errors import UserError
from avn.navigation.navigation_scene import DrawnScene, draw


def test_drawing_gives_cells_moves_rooms_and_sources(two_rooms: DrawnScene) -> None:
    grid = two_rooms.grid
    assert grid.cells == 51
    assert np.bincount(grid.rooms).tolist() == [26, 25]
    assert grid.lattice[two_rooms.sources].tolist() == [[9, 2], [1, 3]]
    doorway = int(np.flatnonzero((grid.lattice == [5, 2]).all(axis=1))[0])
    north, east, south, west = grid.neighbours[doorway]
    assert (north, south) == (-1, -1)
    assert grid.lattice[east].tolist() == [6, 2]
    assert grid.lattice[west].tolist() == [4, 2]


def test_walls_hide_the_source(two_rooms: DrawnScene) -> None:
    at = {tuple(xy): cell for cell, xy in enumerate(two_rooms.grid.lattice.tolist())}
    # The source at (9, 2) is seen through the doorway along its row, and not past the wall.
    assert two_rooms.in_sight[0, at[0, 2]]
    assert two_rooms.in_sight[0, at[6, 4]]
    assert not two_rooms.in_sight[0, at[0, 4]]


@pytest.mark.parametrize(("drawing", "word"), [("aaa", "no source"), ("A#a", "cannot be reached")])
def test_bad_drawings_are_refused(drawing: str, word: str) -> None:
    with pytest.raises(UserError, match=word):
        draw("bad", drawing)
