"""Surfaces: closed, without gaps, and made of what they should be made of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from avn.apartments.floor_plan import CEILING, Doorway, FloorPlan, Piece, Room, Window
from avn.apartments.generator import generate
from avn.apartments.grid import build_grid
from avn.apartments.surfaces import Surfaces, build_surfaces, line_of_sight, shoebox, walls


@pytest.fixture
def plan() -> FloorPlan:
    rooms = (
        Room("kitchen", 0.0, 0.0, 3.0, 3.0, "floor_tiles", "painted_brick", "ceiling_plaster"),
        Room("bedroom", 3.0, 0.0, 6.0, 3.0, "parquet", "plaster", "ceiling_plaster"),
    )
    window = Window(1.5, 0.0, "x", 1.2, 1.1, 1.0)
    return FloorPlan("plan", rooms, (Doorway(3.0, 1.5, "y"),), (window,))


def nearest(
    surfaces: Surfaces, origins: NDArray[np.float64], ways: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Distance to the first surface met and its number, by brute force."""
    distance = np.full((len(origins), len(surfaces.axis)), np.inf)
    for q, axis in enumerate(surfaces.axis):
        a, b = [k for k in range(3) if k != axis]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (surfaces.offset[q] - origins[:, axis]) / ways[:, axis]
            point = origins + t[:, None] * ways
        hit = (t > 1e-9) & (point[:, a] >= surfaces.lower[q, 0] - 1e-12)
        hit &= point[:, a] <= surfaces.upper[q, 0] + 1e-12
        hit &= point[:, b] >= surfaces.lower[q, 1] - 1e-12
        hit &= point[:, b] <= surfaces.upper[q, 1] + 1e-12
        distance[hit, q] = t[hit]
    return distance.min(axis=1), distance.argmin(axis=1)


def area(surfaces: Surfaces, material: str, piece: int | None = None) -> float:
    chosen = surfaces.material == surfaces.materials.index(material)
    if piece is not None:
        chosen &= surfaces.piece == piece
    return float((surfaces.upper - surfaces.lower)[chosen].prod(axis=1).sum())


def test_areas_of_a_hand_made_plan(plan: FloorPlan) -> None:
    surfaces = build_surfaces(plan)
    door, pane = 0.9 * 2.05, 1.2 * 1.0
    # The threshold, 0.9 x 0.1, belongs to the room with the lower index.
    assert area(surfaces, "floor_tiles") == pytest.approx(2.9 * 2.9 + 0.09)
    assert area(surfaces, "parquet") == pytest.approx(2.9 * 2.9)
    assert area(surfaces, "ceiling_plaster") == pytest.approx(2 * 2.9 * 2.9)
    assert area(surfaces, "painted_brick") == pytest.approx(4 * 2.9 * CEILING - door - pane)
    assert area(surfaces, "plaster") == pytest.approx(4 * 2.9 * CEILING - door)
    assert area(surfaces, "glass") == pytest.approx(pane)
    # Two jambs and the lintel, as deep as the wall.
    assert area(surfaces, "wood") == pytest.approx(0.1 * (2 * 2.05 + 0.9))


def test_furniture_shows_only_what_can_be_met(plan: FloorPlan) -> None:
    """What leans on the wall, the floor or another piece has no face there."""
    bed = Piece("bed", 4.5, 2.95 - 1.0, 1.6, 2.0, 0.5, 2, "mattress")
    low = Piece("table", 5.7, 2.95 - 0.2, 0.4, 0.4, 0.5, 2, "fabric")
    high = Piece("box", 5.7 - 0.35, 2.95 - 0.2, 0.3, 0.4, 0.8, 2, "books")
    surfaces = build_surfaces(replace(plan, furniture=(bed, low, high)))
    # The table covers nothing of the bed; the box leans on the bed's side only for its height.
    assert area(surfaces, "mattress", 0) == pytest.approx(1.6 * 2.0 + 1.6 * 0.5 + 2 * 2.0 * 0.5)
    assert area(surfaces, "fabric", 1) == pytest.approx(0.4 * 0.4 + 0.4 * 0.5 + 0.4 * 0.5)
    # The box stands on the table's west side: of its own east face the part above is seen.
    assert area(surfaces, "books", 2) == pytest.approx(
        0.3 * 0.4 + 0.3 * 0.8 + 0.4 * 0.8 + 0.4 * 0.3
    )


@pytest.mark.parametrize("seed", range(3))
def test_no_ray_leaves_the_apartment(seed: int) -> None:
    """From free cells in all directions: something is met, in the house, and not from behind."""
    plan = generate(seed, "closed")
    surfaces, grid = build_surfaces(plan), build_grid(plan)
    rng = np.random.default_rng(seed)
    cells = grid.centres[rng.integers(grid.cells, size=4000)]
    origins = np.column_stack([cells, rng.choice([0.2, 1.0, 1.5, 1.9], size=len(cells))])
    origins[:, :2] += rng.uniform(-0.15, 0.15, size=cells.shape)
    # Some straight along an axis, where an edge would leak first.
    ways = rng.normal(size=origins.shape)
    ways[:300] = np.eye(3)[rng.integers(3, size=300)] * rng.choice([-1, 1], size=(300, 1))
    # Follow each ray over three reflections, so that doorways and nooks are seen from within.
    for _ in range(4):
        distance, quad = nearest(surfaces, origins, ways)
        assert np.isfinite(distance).all()
        points = origins + distance[:, None] * ways
        assert (points[:, 2] > -1e-6).all()
        assert (points[:, 2] < CEILING + 1e-6).all()
        inside = np.zeros(len(points), dtype=bool)
        for room in plan.rooms:
            low, high = np.array([room.x0, room.y0]), np.array([room.x1, room.y1])
            inside |= ((points[:, :2] >= low - 0.051) & (points[:, :2] <= high + 0.051)).all(axis=1)
        for x0, y0, x1, y1 in walls(plan):
            # Nothing is met deeper than the skin of a wall, unless it is over a doorway.
            depth = np.minimum.reduce(
                [points[:, 0] - x0, x1 - points[:, 0], points[:, 1] - y0, y1 - points[:, 1]]
            )
            assert depth.max() < 1e-6
        assert inside.all()
        origins = points
        normal = surfaces.axis[quad]
        ways = ways.copy()
        ways[np.arange(len(ways)), normal] *= -1


def test_line_of_sight_by_hand(plan: FloorPlan) -> None:
    table = Piece("table", 1.0, 1.5, 0.5, 0.5, 0.75, 0, "wood")
    surfaces = build_surfaces(replace(plan, furniture=(table,)))
    cases = [
        ((0.5, 1.5, 1.0), (5.0, 1.5, 1.5), True),  # through the doorway, over the table
        ((0.5, 1.5, 0.5), (5.0, 1.5, 0.5), False),  # through the doorway, into the table
        ((0.5, 0.5, 1.0), (5.5, 0.5, 1.5), False),  # through the wall
        ((2.0, 1.5, 2.2), (4.0, 1.5, 2.2), False),  # over the lintel
        ((2.0, 1.5, 2.0), (4.0, 1.5, 2.0), True),  # under it
        ((2.9, 1.2, 1.5), (3.1, 2.3, 1.5), False),  # into a jamb
        ((0.5, 0.5, 1.0), (2.5, 2.5, 1.5), True),  # across a room
        ((1.5, 1.0, 1.5), (1.5, -1.0, 1.5), False),  # out of the window
        ((2.0, 0.05, 1.0), (2.0, 2.0, 1.5), True),  # begins on the wall
    ]
    origins, targets = (np.array([case[k] for case in cases]) for k in (0, 1))
    expected = [case[2] for case in cases]
    assert line_of_sight(surfaces, origins, targets).tolist() == expected
    assert line_of_sight(surfaces, targets, origins).tolist() == expected


def test_shoebox() -> None:
    surfaces = shoebox((4.0, 3.0, 2.5), "plaster")
    assert len(surfaces.axis) == 6
    assert surfaces.materials == ("plaster",)
    assert area(surfaces, "plaster") == pytest.approx(2 * (12.0 + 10.0 + 7.5))


def test_walls_leave_the_doorway_open(plan: FloorPlan) -> None:
    blocks = walls(plan)
    middle = blocks[(blocks[:, 0] > 2.9) & (blocks[:, 2] < 3.1)]
    assert middle.tolist() == [
        pytest.approx([2.95, -0.05, 3.05, 1.05]),
        pytest.approx([2.95, 1.95, 3.05, 3.05]),
    ]
