"""Wavefront files: what is read, what is left out, what is borne."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from avn.views.obj_files import GLASS, read_mtl, read_obj, to_linear, triangulate

MTL = """
newmtl red
\tKd 1 0 0
newmtl pane
Kd 0 0 1
d 0.2
newmtl wood
Kd 0.5 0.5 0.5
map_Kd wood.png
newmtl lost
map_Kd nowhere.png
"""
OBJ = """
mtllib all.mtl
v 0 0 0
v 2 0 0
v 2 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
usemtl wood
f 1/1 2/2 3/3 4/4
usemtl red
f -4 -3 -2
f 1 1 2
usemtl never
f 1 3 4
"""


def area(triangles: np.ndarray) -> float:
    edges = triangles[:, 1:] - triangles[:, :1]
    return float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1).sum() / 2)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "all.mtl").write_text(MTL)
    (tmp_path / "model.obj").write_text(OBJ)
    Image.new("RGB", (2, 2), (10, 20, 30)).save(tmp_path / "wood.png")
    return tmp_path


def test_polygons_become_triangles_with_their_materials(folder) -> None:
    model = read_obj(folder / "model.obj")
    assert len(model.vertices) == 4  # two of the quad, two more; the one without area is left out
    assert area(model.vertices[:2]) == pytest.approx(2.0)
    wood = model.materials[model.material[0]]
    assert wood.image == folder / "wood.png"
    assert model.uv[:2].max() == 1
    assert model.materials[model.material[2]].colour == (1, 0, 0)
    assert (model.uv[2:] == 0).all()
    assert model.materials[model.material[3]].image is None  # defined nowhere: plain


def test_materials(folder) -> None:
    found = read_mtl(folder / "all.mtl")
    assert found["pane"].clear
    assert not found["wood"].clear
    assert found["wood"].colour == pytest.approx((to_linear(0.5),) * 3)
    assert found["lost"].image is None
    assert read_mtl(folder / "none.mtl") == {}
    assert all(0 <= value <= 1 for value in GLASS)
    (folder / "wood.png").write_bytes(b"no picture")
    assert read_mtl(folder / "all.mtl")["wood"].image is None


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("axes", [(0, 1), (1, 2), (2, 0)])
def test_a_polygon_with_a_dent_is_cut_within_itself(turn: int, axes: tuple[int, int]) -> None:
    """An L of area 3: a fan from its first corner would cover what is not there."""
    flat = np.array([(1, 2), (0, 2), (0, 0), (2, 0), (2, 1), (1, 1)], dtype=float)[::turn]
    ring = np.zeros((6, 3))
    ring[:, axes[0]], ring[:, axes[1]] = flat.T
    triangles = ring[np.array(triangulate(ring))]
    assert len(triangles) == 4
    assert area(triangles) == pytest.approx(3.0)
    middles = triangles.mean(axis=1)[:, list(axes)]
    assert not ((middles > 1).all(axis=1)).any()


def test_sides_that_cross_are_borne() -> None:
    bow = np.array([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0), (0.5, 2, 0)], dtype=float)
    assert len(triangulate(bow)) == 3
    assert triangulate(bow[:2]) == []
