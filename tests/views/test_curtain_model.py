"""Curtains are folds that fill their boxes, in colours of their part."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from avn.apartments.floor_plan import FloorPlan, Piece, Room
from avn.apartments.splits import PARTS
from avn.views.curtain_model import CLOTHS, curtain
from avn.views.models import furniture_mesh
from avn.views.rays import Triangles

ROOM = Room("bedroom", 0.0, 0.0, 5.0, 5.0, "parquet", "plaster", "plaster")


def hung(heading: int, width: float = 0.5) -> FloorPlan:
    x, y = ((2.0, 0.1), (0.1, 2.0), (2.0, 4.9), (4.9, 2.0))[heading]
    piece = Piece("curtain", x, y, width, 0.1, 2.48, heading, "fabric", 0.02)
    return FloorPlan("flat", (ROOM,), (), furniture=(piece,))


@pytest.mark.parametrize("heading", range(4))
def test_a_curtain_fills_its_box_in_all_directions(heading: int) -> None:
    plan = hung(heading)
    vertices = furniture_mesh(plan, "train").vertices
    x0, y0, x1, y1 = plan.furniture[0].bounds
    assert vertices.min(axis=(0, 1)) == pytest.approx((x0, y0, 0.02), abs=1e-6)
    assert vertices.max(axis=(0, 1)) == pytest.approx((x1, y1, 2.5), abs=1e-6)
    at = np.stack(np.meshgrid(np.linspace(x0, x1, 60)[1:-1], np.linspace(y0, y1, 60)[1:-1]), -1)
    above = np.column_stack((at.reshape(-1, 2), np.full(58 * 58, 3.0))).astype(np.float32)
    down = np.tile(np.array([[0, 0, -1]], dtype=np.float32), (len(above), 1))
    assert (Triangles(vertices).intersect(above, down).triangle >= 0).mean() >= 0.8


def test_a_curtain_is_closed() -> None:
    """Each edge is shared by an even number of triangles."""
    corners = curtain(hung(0).furniture[0], "train", "flat").vertices.round(5)
    edges: dict[tuple[tuple[float, ...], ...], int] = {}
    for triangle in corners:
        for i in range(3):
            edge = tuple(sorted((tuple(triangle[i].tolist()), tuple(triangle[i - 1].tolist()))))
            edges[edge] = edges.get(edge, 0) + 1
    assert {count % 2 for count in edges.values()} == {0}


def test_wide_curtains_have_more_folds_and_the_seed_their_colour() -> None:
    narrow, wide = (curtain(hung(0, w).furniture[0], "test", "a") for w in (0.3, 0.6))
    assert len(wide.vertices) > 1.5 * len(narrow.vertices)
    assert (narrow.colour[0] == wide.colour[0]).all()
    colours = {tuple(curtain(hung(0).furniture[0], "test", n).colour[0]) for n in range(30)}
    assert len(colours) == len(CLOTHS["test"])


def test_no_colour_is_in_two_parts() -> None:
    assert set(CLOTHS) == set(PARTS)
    for one, other in combinations(PARTS, 2):
        assert not set(CLOTHS[one]) & set(CLOTHS[other])
