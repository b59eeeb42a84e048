"""Furniture fills its boxes, stays in them, and no two pools share anything."""

from __future__ import annotations

import dataclasses
import hashlib
import shutil
from collections import defaultdict
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import yaml

from avn.apartments.floor_plan import FloorPlan, Piece, Room
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import PARTS, load_split
from avn.views import furniture_models
from avn.views.furniture_models import FOLDER, assets_hash, catalogue, load_model
from avn.views.models import choose, copies, distortion, furniture_mesh
from avn.views.rays import Triangles

CONF = Path(__file__).parents[2] / "conf" / "split"
FILL = 0.8
GRID = 100
MIB = 1 << 20
ROOM_KINDS = {
    "kitchen": {"fridge", "stove", "sink", "counter", "cupboard"},
    "bedroom": {"bed", "nightstand", "dresser", "wardrobe"},
    "living_room": {"sofa", "armchair", "coffee_table", "television", "tv_stand", "bookshelf"},
    "bathroom": {"toilet", "basin", "bathtub", "shower", "washing_machine", "bath_cabinet"},
}


def split(name: str) -> dict[str, list[FloorPlan]]:
    values = yaml.safe_load((CONF / f"{name}.yaml").read_text())
    return load_split(SplitConfig(**values))


PLANS = [
    (name, part, plan)
    for name in ("var", "mini")
    for part, plans in split(name).items()
    for plan in plans
]


def plan_of(*pieces: Piece, name: str = "mine") -> FloorPlan:
    room = Room("bedroom", 0.0, 0.0, 5.0, 5.0, "parquet", "plaster", "plaster")
    return FloorPlan(name, (room,), (), furniture=pieces)


def fill_of(vertices: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """Share of a rectangle that vertical rays on a dense grid find covered."""
    step = (np.arange(GRID) + 0.5) / GRID
    x, y = np.meshgrid(*(lower[i] + step * (upper[i] - lower[i]) for i in (0, 1)))
    origins = np.stack((x.ravel(), y.ravel(), np.full(x.size, upper[2] + 1.0)), axis=-1)
    down = np.tile(np.array([[0.0, 0.0, -1.0]], dtype=np.float32), (len(origins), 1))
    hits = Triangles(vertices).intersect(origins.astype(np.float32), down)
    return float((hits.triangle >= 0).mean())


@pytest.mark.parametrize("model", catalogue(), ids=lambda model: model.name)
def test_model_fills_its_box(model) -> None:
    vertices = load_model(model.name).vertices
    assert vertices.min(axis=(0, 1)) == pytest.approx(0.0)
    assert vertices.max(axis=(0, 1)) == pytest.approx(1.0)
    assert fill_of(vertices, np.zeros(3), np.ones(3)) >= FILL


@pytest.mark.parametrize(("name", "part", "plan"), PLANS, ids=lambda v: getattr(v, "name", v))
def test_every_piece_is_filled_and_not_left(name: str, part: str, plan: FloorPlan) -> None:
    mesh = furniture_mesh(plan, part)
    for index, piece in enumerate(plan.furniture):
        own = mesh.vertices[mesh.piece == index]
        x0, y0, x1, y1 = piece.bounds
        lower = np.array([x0, y0, piece.z])
        upper = np.array([x1, y1, piece.z + piece.height])
        assert own.min(axis=(0, 1)) == pytest.approx(lower, abs=1e-4)
        assert own.max(axis=(0, 1)) == pytest.approx(upper, abs=1e-4)
        assert fill_of(own, lower, upper) >= FILL, piece
    assert np.isfinite(mesh.vertices).all()
    assert np.isfinite(mesh.uv).all()
    assert len(mesh) < 500_000
    assert mesh.colour.min() > 0
    assert mesh.colour.max() <= 1
    assert mesh.texture.min() >= -1
    assert mesh.texture.max() < len(mesh.textures)


def test_pools_share_neither_models_nor_pictures() -> None:
    contents: dict[str, set[str]] = defaultdict(set)
    for model in catalogue():
        shape = load_model(model.name)
        arrays = [shape.vertices, *shape.pictures]
        contents[model.pool] |= {hashlib.sha256(array.tobytes()).hexdigest() for array in arrays}
    assert set(contents) == set(PARTS)
    for one, other in combinations(PARTS, 2):
        assert not contents[one] & contents[other]
    sources = {
        (source, model.pool)
        for model in catalogue()
        for source in model.source.split(", ")
        if "/" in source
    }
    assert len({source for source, _ in sources}) == len(sources)


def test_there_are_enough_models_and_they_are_small() -> None:
    assert len(catalogue()) >= 80
    for kinds in ROOM_KINDS.values():
        assert sum(bool(kinds & set(model.kinds)) for model in catalogue()) >= 10
    for part in PARTS:
        kinds = {kind for model in catalogue() if model.pool == part for kind in model.kinds}
        assert kinds >= set.union(*ROOM_KINDS.values())
        assert kinds >= {"chair", "dining_table", "desk", "plant", "sideboard", "front_door"}
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) <= 20 * MIB


def test_every_model_has_its_licence_and_its_credit() -> None:
    credits = (FOLDER / "README.md").read_text(encoding="utf-8")
    for model in catalogue():
        assert model.author
        assert model.source
        for licence in model.licence.split(" and "):
            assert licence in ("CC0-1.0", "CC-BY-3.0", "CC-BY-3.0-US", "Apache-2.0")
            if licence != "Apache-2.0":
                assert (FOLDER / f"LICENSE.{licence}.txt").is_file()
        if model.licence.startswith("CC-BY"):
            assert f"`{model.name}`" in credits
    assert {path.stem for path in FOLDER.glob("*.npz")} == {model.name for model in catalogue()}


def test_models_of_all_kinds_keep_their_proportions_in_the_benchmark() -> None:
    for _, part, plan in PLANS:
        for index, piece in enumerate(plan.furniture):
            model = choose(plan, index, part)
            assert model is not None, piece.kind
            assert model.pool == part
            assert distortion(model, piece) < np.log(3.5), (piece, model.name)


def test_same_apartment_same_triangles_and_another_look_other_ones() -> None:
    plan = split("var")["train"][0]
    one, same = furniture_mesh(plan, "train"), furniture_mesh(plan, "train")
    for field in dataclasses.fields(one):
        if field.name != "textures":
            assert getattr(one, field.name).tobytes() == getattr(same, field.name).tobytes()
    assert [t.tobytes() for t in one.textures] == [t.tobytes() for t in same.textures]
    variants = {furniture_mesh(plan, "train", seed).vertices.tobytes() for seed in range(4)}
    assert len(variants) > 1


def test_the_hash_of_the_models_is_of_their_files(tmp_path, monkeypatch) -> None:
    before = assets_hash()
    folder = Path(shutil.copytree(furniture_models.FOLDER, tmp_path / "models"))
    monkeypatch.setattr(furniture_models, "FOLDER", folder)
    assert furniture_models.assets_hash.__wrapped__() == before
    model = next(folder.glob("*.npz"))
    content = bytearray(model.read_bytes())
    content[-1] ^= 1
    model.write_bytes(content)
    assert furniture_models.assets_hash.__wrapped__() != before


@pytest.mark.parametrize(
    ("heading", "front"), [(0, (0, 1)), (1, (1, 0)), (2, (0, -1)), (3, (-1, 0))]
)
def test_the_back_of_a_sofa_is_behind(heading: int, front: tuple[int, int]) -> None:
    """The tall part of a sofa, its back, lies on the side away from where it faces."""
    sofa = Piece("sofa", 2.0, 2.0, 1.8, 0.85, 0.8, heading, "upholstery")
    vertices = furniture_mesh(plan_of(sofa), "test").vertices
    tall = vertices.reshape(-1, 3)[vertices.reshape(-1, 3)[:, 2] > 0.75]
    assert (tall[:, :2] - 2.0).mean(axis=0) @ np.array(front) < -0.15


def test_equal_chairs_of_a_room_are_alike() -> None:
    chairs = [Piece("chair", x, 1.0, 0.45, 0.45, 0.9, 0, "wood") for x in (1.0, 2.0, 3.0)]
    plan = plan_of(*chairs)
    assert len({choose(plan, index, "train").name for index in range(3)}) == 1


def test_an_unknown_kind_is_its_box() -> None:
    piece = Piece("aquarium", 1.0, 2.0, 0.7, 0.3, 0.5, 1, "glass", z=0.4)
    mesh = furniture_mesh(plan_of(piece), "test")
    assert len(mesh) == 12
    assert mesh.vertices.min(axis=(0, 1)) == pytest.approx([0.85, 1.65, 0.4])
    assert mesh.vertices.max(axis=(0, 1)) == pytest.approx([1.15, 2.35, 0.9])


def test_odd_sizes_are_filled_too() -> None:
    odd = [
        Piece("cupboard", 2.5, 0.2, 4.6, 0.2, 0.5, 0, "laminate", z=1.4),
        Piece("wardrobe", 1.0, 3.0, 0.3, 0.9, 2.5, 3, "wood"),
        Piece("bed", 3.0, 3.0, 0.4, 0.5, 0.1, 2, "mattress"),
    ]
    mesh = furniture_mesh(plan_of(*odd), "train")
    for index, piece in enumerate(odd):
        own = mesh.vertices[mesh.piece == index]
        assert own[..., :2].min(axis=(0, 1)) == pytest.approx(piece.bounds[:2], abs=1e-4)
        assert own[..., :2].max(axis=(0, 1)) == pytest.approx(piece.bounds[2:], abs=1e-4)
    assert len(furniture_mesh(plan_of(), "train")) == 0


def test_wide_cupboards_are_rows_of_cupboards() -> None:
    wide = Piece("cupboard", 2.5, 0.2, 2.6, 0.35, 0.7, 0, "laminate", z=1.45)
    model = choose(plan_of(wide), 0, "train")
    assert copies(model, wide) >= 3
