"""The split of homes: frozen by hashes, not selected, and the same in all parts."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
import yaml

from avn.apartments import frozen_hashes, splits
from avn.apartments.floor_plan import FloorPlan
from avn.apartments.floor_plan_checks import check
from avn.apartments.frozen_hashes import FrozenApartment, floor_plan_hash, frozen_apartments
from avn.apartments.generator import generate
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import PARTS, draw_apartment, load_split, part_of_layout
from avn.apartments.symmetry import layout_key
from avn.core.errors import UserError

CONF = Path(__file__).parents[2] / "conf" / "split"
HOMES = SplitConfig(**yaml.safe_load((CONF / "homes.yaml").read_text()))
# First eight digits of the hashes of the first apartments of each part.
FIRST = {
    "train": ["bbc5d33c", "b5fd9362", "13ac2999"],
    "validation": ["32abaefb", "1acc8b29", "a4487df9"],
    "test": ["b7133621", "ecb19b56", "baa6016a"],
}


def homes(train: int = 1, validation: int = 1, test: int = 1) -> dict[str, list[FloorPlan]]:
    return dict(load_split(replace(HOMES, train=train, validation=validation, test=test)))


@pytest.fixture(scope="module")
def some() -> dict[str, list[FloorPlan]]:
    """The first twelve apartments of each part."""
    return homes(12, 12, 12)


def hashes(plans: list[FloorPlan]) -> list[str]:
    return [floor_plan_hash(plan)[:8] for plan in plans]


def test_the_split_has_its_numbers_and_settings() -> None:
    assert (HOMES.train, HOMES.validation, HOMES.test) == (100, 20, 50)
    assert {part: len(frozen_apartments(HOMES, part)) for part in PARTS} == {
        "train": 100, "validation": 20, "test": 50,
    }  # fmt: skip
    procedural = yaml.safe_load((CONF / "procedural.yaml").read_text())
    for key in ("seed", "train_sources", "sources"):
        assert getattr(HOMES, key) == procedural[key]


def test_the_first_apartments_are_the_frozen_ones() -> None:
    split = homes(3, 3, 3)
    assert {part: hashes(plans) for part, plans in split.items()} == FIRST
    for part, plans in split.items():
        assert [entry.hash for entry in frozen_apartments(HOMES, part)][:3] == [
            floor_plan_hash(plan) for plan in plans
        ]
        for plan in plans:
            check(plan, plan.name)
            assert {part_of_layout(layout_key(plan)), part} == {part}


def test_the_number_of_apartments_changes_no_apartment() -> None:
    few, many = homes(1, 2, 3), homes(3, 1, 1)
    for part in PARTS:
        assert all(a == b for a, b in zip(few[part], many[part], strict=False))


def test_an_apartment_depends_on_its_number_alone() -> None:
    """It is the same where the others are never drawn, and without the table."""
    free = replace(HOMES, hashes=None)
    for part in PARTS:
        tally: Counter[str] = Counter()
        alone = draw_apartment(free, part, 2, tally=tally)
        assert hashes([alone]) == FIRST[part][2:]
        assert frozen_apartments(HOMES, part)[2].skip == tally.total() - 1
        assert tally["whole"] == 1


def test_no_apartment_is_in_two_parts(some: dict[str, list[FloorPlan]]) -> None:
    entries = [entry for part in PARTS for entry in frozen_apartments(HOMES, part)]
    assert len({entry.hash for entry in entries}) == len(entries) == 170
    keys = {part: {layout_key(plan) for plan in plans} for part, plans in some.items()}
    assert not keys["train"] & (keys["validation"] | keys["test"])
    assert not keys["validation"] & keys["test"]


def test_sizes_and_furniture_have_the_same_distribution_in_all_parts(
    some: dict[str, list[FloorPlan]],
) -> None:
    """Rooms, floor area and pieces of the first twelve differ by less than chance explains."""
    measures = {
        part: np.array(
            [
                (
                    len(plan.rooms),
                    sum((r.x1 - r.x0) * (r.y1 - r.y0) for r in plan.rooms),
                    sum(piece.kind != "curtain" for piece in plan.furniture),
                )
                for plan in plans
            ]
        )
        for part, plans in some.items()
    }
    for values in measures.values():
        assert set(values[:, 0]) == {3, 4, 5}
    for one, other in (("train", "test"), ("train", "validation"), ("validation", "test")):
        a, b = measures[one], measures[other]
        error = np.sqrt((a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / 12)
        assert (np.abs(a.mean(axis=0) - b.mean(axis=0)) < 3 * error).all()


def test_only_the_part_that_is_asked_for_is_generated(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = []

    def counted(*arguments: object) -> FloorPlan:
        drawn.append(arguments[1:3])
        return draw_apartment(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(splits, "draw_apartment", counted)
    split = load_split(replace(HOMES, test=2))
    assert list(split) == list(PARTS)
    assert len(split) == 3
    assert drawn == []
    assert len(split["test"]) == len(split["test"]) == 2
    assert drawn == [("test", 0), ("test", 1)]
    with pytest.raises(KeyError):
        split["other"]


def test_another_hash_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    table = frozen_hashes._table("homes")
    changed = {**table["test"][1], "hash": "0" * 64}
    other = {**table, "test": [table["test"][0], changed]}
    monkeypatch.setattr(frozen_hashes, "_table", lambda name: other)
    split = load_split(replace(HOMES, test=2))
    with pytest.raises(UserError) as told:
        split["test"]
    wanted = (
        "split.hashes: apartment room_2 of 'homes' is frozen as floor plan 00000000 and was "
        f"generated as {FIRST['test'][1]}; install the versions of avn and NumPy that it was "
        "frozen with, or add split.hashes=null to use it as generated"
    )
    assert str(told.value) == wanted
    assert len(load_split(replace(HOMES, test=1))["test"]) == 1
    assert len(load_split(replace(HOMES, test=2, hashes=None))["test"]) == 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"test": 51}, r"split\.test is 51, and 'homes' has 50 frozen .*; give at most as many"),
        ({"seed": 1}, r"split\.seed is 1, and the apartments of 'homes' are frozen with 1000;"),
        ({"size": "small"}, r"split\.size is small, and .* frozen with homes; leave it out"),
        ({"sources": 4}, r"split\.sources is 4, .* add split\.hashes=null"),
        ({"hashes": "none"}, r"split\.hashes is 'none'; choose homes, or null"),
        ({"hashes": "../homes"}, r"split\.hashes is '../homes'; choose homes, or null"),
    ],
)
def test_settings_that_are_not_frozen_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(UserError, match=message):
        load_split(replace(HOMES, **change))  # type: ignore[arg-type]


def test_a_table_is_written_and_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entries = {part: frozen_apartments(HOMES, part)[:2] for part in PARTS}
    real = (frozen_hashes.FOLDER / "homes.json").read_text()
    monkeypatch.setattr(frozen_hashes, "FOLDER", tmp_path)
    frozen_hashes.write_table("mine", HOMES, entries)
    mine = replace(HOMES, hashes="mine", train=1, validation=1, test=2)
    assert frozen_apartments(mine, "test") == entries["test"]
    assert isinstance(entries["test"][0], FrozenApartment)
    assert (tmp_path / "mine.json").read_text().splitlines()[:4] == real.splitlines()[:4]


def test_most_rooms_for_living_are_soft(some: dict[str, list[FloorPlan]]) -> None:
    plans = list(chain(*some.values()))
    living = [r for plan in plans for r in plan.rooms if r.kind in ("bedroom", "living_room")]
    assert 0.7 < np.mean([room.floor == "carpet" for room in living]) < 1
    hung = [sum(piece.kind == "curtain" for piece in plan.furniture) for plan in plans]
    assert 2.5 < np.mean(hung) < 8
    assert not any(p.kind == "curtain" for p in generate(3, "flat", size="mixed").furniture)
