"""Files of floor plans: what is written is read, and what is wrong is named."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from avn.apartments.floor_plan import FloorPlan, Piece
from avn.apartments.floor_plan_file import load
from avn.apartments.generator import generate
from avn.core.errors import UserError


@pytest.fixture(scope="module")
def plan() -> FloorPlan:
    return generate(0, "home", 2, "small")


def test_a_file_gives_the_plan_back(plan: FloorPlan, tmp_path: Path) -> None:
    path = tmp_path / "home.json"
    path.write_text(plan.to_json())
    assert load(path) == plan
    assert load(path).to_json() == plan.to_json()


@pytest.mark.parametrize(
    ("heading", "bounds"),
    [(0, (0, 1, 2, 3)), (1, (0.5, 1, 1.5, 3)), (2, (0, 1, 2, 3)), (3, (0.5, 1, 1.5, 3))],
)
def test_width_is_across_the_way_a_piece_faces(heading: int, bounds: tuple[float, ...]) -> None:
    piece = Piece("bed", 1.0, 2.0, 2.0, 1.0 if heading % 2 else 2.0, 0.5, heading, "mattress")
    assert piece.bounds == pytest.approx(bounds)


def change(data: dict[str, Any], part: str, key: str, value: object) -> None:
    data[part][0][key] = value


@pytest.mark.parametrize(
    ("part", "key", "value", "message"),
    [
        ("rooms", "kind", "hall", "room kind 'hall' is none of kitchen"),
        ("rooms", "x0", 0.3, "walls are on the 0.5 m lattice"),
        ("furniture", "width", -1.0, "'width' is -1; give at least 0.01 m"),
        ("furniture", "x", 1e9, "'x' is 1000000000.0"),
        ("rooms", "x0", "west", "'x0' is 'west'; give a number"),
        ("rooms", "colour", "red", "unknown key 'colour'"),
        ("doorways", "along", "z", "'along' is 'z', not 'x' or 'y'"),
        ("doorways", "x", 1.21, "is not centred on the 0.5 m lattice"),
        ("furniture", "heading", 4, "'heading' is 4; give 0 north"),
    ],
)
def test_mistakes_are_named(
    plan: FloorPlan, tmp_path: Path, part: str, key: str, value: object, message: str
) -> None:
    data = json.loads(plan.to_json())
    change(data, part, key, value)
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(data))
    with pytest.raises(UserError) as error:
        load(path)
    assert str(path) in str(error.value)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"none\.json: No such file"):
        load(tmp_path / "none.json")
