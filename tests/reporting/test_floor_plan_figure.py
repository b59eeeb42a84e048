"""The picture of a floor plan shows all that it should."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.image import imread

from avn.apartments.generator import generate
from avn.apartments.grid import build_grid
from avn.reporting.floor_plan_figure import floor_plan_figure, save_floor_plan


def test_everything_is_drawn() -> None:
    plan = generate(0, "home", 2, "small")
    grid = build_grid(plan)
    (axes,) = floor_plan_figure(plan, grid).axes
    words = [text.get_text() for text in axes.texts]
    for room in plan.rooms:
        assert room.kind.replace("_", " ") in words
    for piece in plan.furniture:
        if piece.z == 0:
            assert piece.kind.replace("_", " ") in words
    rectangles = {
        tuple(np.round([*p.get_xy(), p.get_width(), p.get_height()], 4).tolist())
        for p in axes.patches
    }
    for piece in plan.furniture:
        x0, y0, x1, y1 = piece.bounds
        assert tuple(np.round([x0, y0, x1 - x0, y1 - y0], 4).tolist()) in rectangles
    drawn = [line.get_xydata() for line in axes.lines]
    assert any(np.array_equal(points, grid.centres) for points in drawn)
    assert any(np.array_equal(points, np.array(plan.sources)) for points in drawn)
    # The tick of the first piece points the way that it faces.
    piece = plan.furniture[0]
    way = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])[piece.heading]
    end = np.array([piece.x, piece.y]) + way * piece.depth / 2
    assert any(len(p) == 2 and np.allclose(p[1], end) for p in drawn)


def test_the_file_is_small_and_repeatable(tmp_path: Path) -> None:
    plan = generate(1, "home", 2, "small")
    paths = [tmp_path / "new" / name for name in ("a.png", "b.png")]
    for path in paths:
        save_floor_plan(plan, path)
    first, second = (path.read_bytes() for path in paths)
    assert first == second
    assert len(first) < 80_000
    picture = imread(paths[0])
    assert picture.shape[0] > 300
    assert len(np.unique(picture.reshape(-1, picture.shape[-1]), axis=0)) > 10
