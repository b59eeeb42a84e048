"""The three splits, and what is said when one is broken."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import chain
from pathlib import Path

import pytest
import yaml

from avn.apartments.floor_plan import FloorPlan, from_dict
from avn.apartments.generator import generate
from avn.apartments.grid import build_grid
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import FROZEN, PARTS, load_split, more_training, part_of_layout
from avn.apartments.symmetry import Key, layout_key
from avn.core.errors import UserError
from avn.core.random import derive

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
    cfg = replace(config("procedural"), train=3, validation=2, test=2)
    split = load_split(cfg)
    assert [len(plans) for plans in split.values()] == [cfg.train, cfg.validation, cfg.test]
    plans = list(chain(*split.values()))
    assert len({layout_key(plan) for plan in plans}) == len(plans)
    assert {len(plan.sources) for plan in split["train"]} == {cfg.train_sources}
    assert {len(plan.sources) for plan in split["test"]} == {cfg.sources}


def generated(train: int, validation: int, test: int, **more: int) -> dict[str, list[FloorPlan]]:
    numbers = {"train": train, "validation": validation, "test": test}
    return load_split(SplitConfig(**{"name": "own", "size": "small", **numbers, **more}))  # type: ignore[arg-type]


def test_the_number_of_apartments_of_a_part_changes_no_other_apartment() -> None:
    few, many = generated(1, 2, 1), generated(4, 1, 2)
    for part in PARTS:
        shared = list(zip(few[part], many[part], strict=False))
        assert shared
        assert all(one.to_json() == other.to_json() for one, other in shared)


def test_a_layout_belongs_to_one_part_whatever_the_seed() -> None:
    layouts: dict[str, set[Key]] = {part: set() for part in PARTS}
    for seed in range(3):
        for part, plans in generated(2, 2, 2, seed=seed).items():
            layouts[part] |= {layout_key(plan) for plan in plans}
            assert {part_of_layout(layout_key(plan)) for plan in plans} == {part}
    assert len(set.union(*layouts.values())) == sum(map(len, layouts.values())) > 15


def test_seeds_draw_other_apartments() -> None:
    texts = [plan.to_json() for s in (0, 1) for plan in chain(*generated(2, 2, 2, seed=s).values())]
    assert len(set(texts)) == len(texts) == 12


def test_the_part_of_a_layout_is_that_of_its_mirror_image_and_of_its_file() -> None:
    plan = generate(5, "home")
    rooms = tuple(replace(r, x0=-r.x1, x1=-r.x0) for r in plan.rooms)
    doorways = tuple(replace(d, x=-d.x) for d in plan.doorways)
    mirrored = replace(plan, rooms=rooms, doorways=doorways)
    for other in (mirrored, from_dict(json.loads(plan.to_json()))):
        assert part_of_layout(layout_key(other)) == part_of_layout(layout_key(plan))


def test_a_layout_that_comes_again_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    def one_seed(*names: object) -> int:
        return 7 if names[0] == "apartment" else derive(*names)

    monkeypatch.setattr("avn.apartments.splits.derive", one_seed)
    plans = generated(3, 1, 1)["train"]
    assert len({layout_key(plan) for plan in plans}) == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"test": 0}, r"split\.test is 0; give at least 1"),
        ({"validation": -1}, r"split\.validation is -1; give at least 1"),
        ({"sources": 0}, r"split\.sources is 0; give at least 1"),
        ({"seed": -1}, r"split\.seed is -1; give 0 or more"),
        ({"size": "huge"}, r"split\.size is 'huge'; choose one of small"),
        ({"folder": "nowhere"}, r"split\.folder: nowhere does not exist; give a folder"),
        ({"folder": ""}, r"split\.folder is empty; give a folder"),
        ({"folder": __file__}, r"split\.folder: .*test_splits\.py is a file; give a folder"),
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


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("training_1.json", "not clear whether it is a test apartment; name it train_"),
        ("Validation_1.json", "not clear whether it is a test apartment"),
        ("train1.json", "not clear whether it is a test apartment"),
        ("val.json", None),
        ("valley_1.json", None),
        ("trainer.json", None),
        ("room_9.yaml", r"not read; floor plans are files \*\.json"),
        ("notes.txt", None),
        (".room_9.json", None),
    ],
)
def test_a_file_that_may_be_meant_otherwise_is_refused(
    tmp_path: Path, name: str, message: str | None
) -> None:
    folder = copy_of_var(tmp_path)
    data = json.loads((folder / "room_1.json").read_text())
    (folder / name).write_text(json.dumps({**data, "name": Path(name).stem}))
    if message is None:
        assert sum(map(len, load_split(SplitConfig(folder=str(folder))).values())) >= 10
        return
    with pytest.raises(UserError, match=rf"{name}: {message}"):
        load_split(SplitConfig(folder=str(folder)))


def test_the_working_directory_is_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mini").mkdir()
    copy_of_var(tmp_path / "mini")
    monkeypatch.chdir(tmp_path / "mini")
    assert [plan.name for plan in load_split(SplitConfig(folder="."))["train"]] == [
        "train_1",
        "train_2",
    ]
    monkeypatch.chdir(tmp_path)
    sizes = [len(load_split(SplitConfig(folder=name))["test"]) for name in ("mini", "./mini")]
    assert sizes == [1, 5]


def test_a_folder_without_floor_plans_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("none yet")
    with pytest.raises(UserError, match=r"split\.folder: no floor plan in .*; add one"):
        load_split(SplitConfig(folder=str(tmp_path)))


def test_generated_training_apartments_are_those_of_procedural() -> None:
    few, more = more_training(config("var"), 1), more_training(config("var"), 8)
    drawn = load_split(config("procedural"))["train"]
    assert few == drawn[:1]
    assert more == drawn
    assert more_training(config("procedural"), 0) == []
    frozen = {layout_key(plan) for plans in load_split(config("var")).values() for plan in plans}
    assert not frozen & {layout_key(plan) for plan in drawn}


def test_generated_training_apartments_of_a_wrong_number_or_split_are_refused() -> None:
    with pytest.raises(UserError, match=r"training\.generated: -1; give 0 or more"):
        more_training(config("var"), -1)
    with pytest.raises(UserError, match=r"'procedural' is generated itself; give 0, and more"):
        more_training(config("procedural"), 1)
