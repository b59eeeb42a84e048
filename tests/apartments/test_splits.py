"""The three splits, and what is said when one is broken."""

from __future__ import annotations

from itertools import chain
from pathlib import Path

import pytest
import yaml

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import build_grid
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import FROZEN, load_split
from avn.apartments.symmetry import layout_key
from avn.core.errors import UserError

CONF = Path(__file__).parents[2] / "conf" / "split"
SOUNDS = 3


def config(name: str) -> SplitConfig:
    values = yaml.safe_load((CONF / f"{name}.yaml").read_text())
    return SplitConfig(**values)


def names(split: dict[str, list[FloorPlan]]) -> dict[str, list[str]]:
    return {part: [plan.name for plan in plans] for part, plans in split.items()}


def test_var_has_the_numbers_of_the_paper() -> None:
    split = load_split(config("var"))
    assert names(split) == {
        "train": ["train_1", "train_2"],
        "validation": ["val_1", "val_2", "val_3"],
        "test": [f"room_{n}" for n in range(1, 6)],
    }
    grids = {part: [build_grid(plan) for plan in plans] for part, plans in split.items()}
    cells = {part: sum(grid.cells for grid in grids[part]) for part in grids}
    assert (cells["train"], cells["test"]) == (330, 602)
    assert cells["train"] + cells["test"] == 932
    assert 4 * (cells["train"] + cells["test"]) == 3728
    clips = sum(
        SOUNDS * len(plan.sources) * 4 * grid.cells
        for part in ("train", "test")
        for plan, grid in zip(split[part], grids[part], strict=True)
    )
    assert clips == 75_720
    for part, plans in split.items():
        for plan, grid in zip(plans, grids[part], strict=True):
            assert len(plan.sources) == len(set(plan.sources)) == (10 if part == "train" else 5)
            assert 150 <= grid.squares <= 200
            assert part != "validation" or 110 <= grid.cells <= 130


def test_frozen_files_are_what_the_plan_writes() -> None:
    for plan in chain(*load_split(config("var")).values()):
        assert (FROZEN / "var" / f"{plan.name}.json").read_text() == plan.to_json()


def test_mini_is_small() -> None:
    split = load_split(config("mini"))
    assert [len(plans) for plans in split.values()] == [1, 1, 1]
    for part, (plan,) in split.items():
        assert 50 <= build_grid(plan).cells <= 70
        assert len(plan.rooms) == 3
        assert len(plan.sources) == (3 if part == "train" else 2)


def test_procedural_has_no_copies() -> None:
    cfg = config("procedural")
    split = load_split(cfg)
    assert [len(plans) for plans in split.values()] == [cfg.train, cfg.validation, cfg.test]
    plans = list(chain(*split.values()))
    assert len({layout_key(plan) for plan in plans}) == len(plans)
    assert {len(plan.sources) for plan in split["train"]} == {cfg.train_sources}
    assert {len(plan.sources) for plan in split["test"]} == {cfg.sources}


def test_a_layout_that_comes_again_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    from avn.apartments import splits

    drawn = []

    def every_seed_twice(seed: int, name: str, sources: int, size: str) -> FloorPlan:
        drawn.append(seed)
        return generate(seed // 2, name, sources, size)

    generate = splits.generate
    monkeypatch.setattr(splits, "generate", every_seed_twice)
    cfg = SplitConfig("procedural", None, 0, "small", 1, 1, 1, 2, 2)
    plans = list(chain(*load_split(cfg).values()))
    assert drawn == [0, 1, 2, 3, 4]
    assert len({layout_key(plan) for plan in plans}) == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"test": 0}, r"split\.test is 0; give at least 1"),
        ({"validation": -1}, r"split\.validation is -1; give at least 1"),
        ({"sources": 0}, r"split\.sources is 0; give at least 1"),
        ({"seed": -1}, r"split\.seed is -1; give 0 or more"),
        ({"size": "huge"}, r"split\.size is 'huge'; choose one of small"),
        ({"folder": "nowhere"}, r"split\.folder: there is no folder nowhere"),
    ],
)
def test_bad_values_are_named(change: dict[str, object], message: str) -> None:
    with pytest.raises(UserError, match=message):
        load_split(SplitConfig(**{"folder": None, "size": "small", **change}))  # type: ignore[arg-type]


def copy_of_var(folder: Path) -> Path:
    for path in (FROZEN / "var").glob("*.json"):
        (folder / path.name).write_bytes(path.read_bytes())
    return folder


@pytest.mark.parametrize(
    ("files", "part"), [("room_*", "test"), ("val_*", "validation"), ("train_*", "train")]
)
def test_a_folder_may_lack_a_part(tmp_path: Path, files: str, part: str) -> None:
    folder = copy_of_var(tmp_path)
    assert names(load_split(SplitConfig(folder=str(folder))))["test"][0] == "room_1"
    for path in folder.glob(files + ".json"):
        path.unlink()
    split = load_split(SplitConfig(folder=str(folder)))
    assert [name for name in split if not split[name]] == [part]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON"),
        ('{"format": 99}', "not a floor plan of format"),
        ('{"format": 1, "name": "room_1"}', "key 'sources' is missing"),
        ("[]", "not a floor plan of format"),
    ],
)
def test_a_broken_file_is_named(tmp_path: Path, text: str, message: str) -> None:
    folder = copy_of_var(tmp_path)
    (folder / "room_1.json").write_text(text)
    with pytest.raises(UserError, match=rf"room_1\.json: {message}"):
        load_split(SplitConfig(folder=str(folder)))


def test_a_file_under_another_name_is_refused(tmp_path: Path) -> None:
    folder = copy_of_var(tmp_path)
    (folder / "room_2.json").rename(folder / "room_9.json")
    with pytest.raises(UserError, match=r"room_9\.json: the plan is named 'room_2'"):
        load_split(SplitConfig(folder=str(folder)))
