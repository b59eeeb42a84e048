"""The grid against a hand-made plan, networkx and geometry of its own."""

from __future__ import annotations

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest

from avn.apartments.floor_plan import Doorway, FloorPlan, Piece, Room
from avn.apartments.generator import generate
from avn.apartments.grid import build_grid, goal_cells, source_cells
from avn.core.errors import UserError

FINISH = {"floor": "parquet", "walls": "plaster", "ceiling": "ceiling_plaster"}


@pytest.fixture
def two_rooms() -> FloorPlan:
    """Two rooms of 3 x 3 squares, joined by a doorway in the middle of their wall."""
    rooms = (
        Room("kitchen", 0.0, 0.0, 2.0, 2.0, **FINISH),
        Room("bedroom", 2.0, 0.0, 4.0, 2.0, **FINISH),
    )
    return FloorPlan("two", rooms, (Doorway(2.0, 1.0, "y"),), sources=((0.5, 0.5), (3.5, 1.5)))


def test_hand_made_plan(two_rooms: FloorPlan) -> None:
    grid = build_grid(two_rooms)
    expected = {(x, y) for y in (1, 2, 3) for x in (1, 2, 3, 5, 6, 7)} | {(4, 2)}
    assert {tuple(cell) for cell in grid.lattice.tolist()} == expected
    assert grid.squares == 19 == grid.cells
    assert source_cells(two_rooms, grid).tolist() == [
        grid.lattice.tolist().index([1, 1]),
        grid.lattice.tolist().index([7, 3]),
    ]
    corner, door = (grid.lattice.tolist().index(cell) for cell in ([1, 1], [4, 2]))
    north, east = (grid.lattice.tolist().index(cell) for cell in ([1, 2], [2, 1]))
    assert grid.neighbours[corner].tolist() == [north, east, -1, -1]
    assert (grid.neighbours[door][[0, 2]] == -1).all()
    assert (grid.neighbours[door][[1, 3]] >= 0).all()
    assert grid.distances[corner, door] == 4
    assert grid.distances[tuple(source_cells(two_rooms, grid))] == 8
    # The doorway belongs to the room with the lower index.
    assert grid.rooms[door] == 0
    assert (grid.rooms == (grid.lattice[:, 0] > 4)).all()


@pytest.mark.parametrize(
    ("front", "blocked_columns"),
    [(0.25, 0), (0.29, 0), (0.31, 1), (0.79, 1), (0.81, 2)],
)
def test_disc_of_20_cm(two_rooms: FloorPlan, front: float, blocked_columns: int) -> None:
    """A piece along the west wall takes the columns of which it is nearer than 0.2 m."""
    depth = front - 0.05
    piece = Piece("shelf", 0.05 + depth / 2, 1.0, 1.9, depth, 1.0, 1, "wood")
    grid = build_grid(replace(two_rooms, furniture=(piece,), sources=()))
    assert set(grid.lattice[grid.rooms == 0][:, 0]) - {4} == set(range(1 + blocked_columns, 4))
    assert grid.squares == 19


def test_a_move_needs_the_swept_disc(two_rooms: FloorPlan) -> None:
    """A post between two free cells stops the move between them and no other."""
    post = Piece("post", 0.75, 0.5, 0.05, 0.05, 1.0, 0, "wood")
    plain = build_grid(two_rooms)
    grid = build_grid(replace(two_rooms, furniture=(post,)))
    assert (grid.lattice == plain.lattice).all()
    changed = np.argwhere(grid.neighbours != plain.neighbours).tolist()
    cells = plain.lattice.tolist()
    assert sorted(changed) == sorted([[cells.index([1, 1]), 1], [cells.index([2, 1]), 3]])


def test_what_hangs_is_walked_under(two_rooms: FloorPlan) -> None:
    hanging = Piece("lamp", 1.0, 1.0, 0.5, 0.5, 0.3, 0, "metal", z=1.75)
    assert build_grid(replace(two_rooms, furniture=(hanging,))).cells == 19
    low = replace(hanging, z=1.6)
    assert build_grid(replace(two_rooms, furniture=(low,))).cells == 18


def test_cells_that_are_cut_off_are_named(two_rooms: FloorPlan) -> None:
    with pytest.raises(UserError, match=r"two: the free cell at \(2.5, 0.5\) cannot be reached"):
        build_grid(replace(two_rooms, doorways=()))


def test_source_off_the_cells_is_named(two_rooms: FloorPlan) -> None:
    with pytest.raises(UserError, match=r"two: the source at \(0.6, 0.5\) is not on a free cell"):
        build_grid(replace(two_rooms, sources=((0.6, 0.5),)))


def test_goal_cells(two_rooms: FloorPlan) -> None:
    grid = build_grid(two_rooms)
    goal = goal_cells(grid)
    cells = grid.lattice.tolist()
    around = {tuple(cells[c]) for c in np.flatnonzero(goal[cells.index([3, 2])])}
    # East of (3, 2) is the doorway; the wall takes the two squares beside it.
    assert around == {(2, 1), (3, 1), (2, 2), (3, 2), (4, 2), (2, 3), (3, 3)}


def test_the_other_side_of_a_wall_is_no_goal(two_rooms: FloorPlan) -> None:
    """Two cells side by side in a straight line, but far to walk, do not count."""
    partition = Piece("partition", 0.75, 0.65, 0.05, 1.2, 2.0, 0, "wood")
    grid = build_grid(replace(two_rooms, furniture=(partition,)))
    cells = grid.lattice.tolist()
    assert grid.distances[cells.index([1, 1]), cells.index([2, 1])] == 5
    assert not goal_cells(grid)[cells.index([1, 1]), cells.index([2, 1])]


@pytest.mark.parametrize("seed", range(4))
def test_distances_are_those_of_networkx(seed: int) -> None:
    plan = generate(seed, "peer")
    grid = build_grid(plan)
    graph = nx.Graph()
    graph.add_nodes_from(range(grid.cells))
    for cell, row in enumerate(grid.neighbours.tolist()):
        for heading, other in enumerate(row):
            if other >= 0:
                step = grid.lattice[other] - grid.lattice[cell]
                assert step.tolist() == [[0, 1], [1, 0], [0, -1], [-1, 0]][heading]
                # Every move has a way back.
                assert grid.neighbours[other, (heading + 2) % 4] == cell
                graph.add_edge(cell, other)
    for cell, reached in nx.all_pairs_shortest_path_length(graph):
        assert len(reached) == grid.cells
        assert [reached[c] for c in range(grid.cells)] == grid.distances[cell].tolist()
