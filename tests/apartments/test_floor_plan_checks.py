"""A floor plan that cannot be built is refused in one line that names the entry."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import Any

import pytest
import yaml

from avn.apartments.floor_plan import FloorPlan, Lamp
from avn.apartments.floor_plan_checks import check
from avn.apartments.floor_plan_file import load
from avn.apartments.generator import SIZES, generate
from avn.apartments.grid import build_grid
from avn.apartments.splits import FROZEN, SplitConfig, load_split
from avn.core.errors import UserError

TOP = Path(__file__).parents[2]
Data = dict[str, Any]
Change = Callable[[Data], object]


def room(kind: str, *bounds: float) -> Data:
    x0, y0, x1, y1 = bounds
    finish = {"floor": "parquet", "walls": "plaster", "ceiling": "ceiling_plaster"}
    return {"kind": kind, "x0": x0, "y0": y0, "x1": x1, "y1": y1, **finish}


def piece(kind: str, x: float, y: float, width: float, depth: float, **more: Any) -> Data:
    box = {"kind": kind, "x": x, "y": y, "width": width, "depth": depth}
    return {**box, "height": 0.8, "heading": 0, "material": "wood", **more}


def home() -> Data:
    """An L of three rooms: kitchen and bedroom side by side, a bathroom to the north."""
    return {
        "format": 1,
        "name": "home",
        "rooms": [
            room("kitchen", 0, 0, 3, 3),
            room("bedroom", 3, 0, 6, 3),
            room("bathroom", 0, 3, 3, 5),
        ],
        "doorways": [{"x": 3, "y": 1.5, "along": "y"}, {"x": 1.5, "y": 3, "along": "x"}],
        "windows": [
            {"x": 1.5, "y": 0, "along": "x", "width": 1.2, "sill": 1, "height": 1},
            {"x": 4.5, "y": 3, "along": "x", "width": 1.2, "sill": 1, "height": 1},
        ],
        "furniture": [
            piece("sofa", 0.45, 0.9, 0.8, 1.6),
            piece("bed", 5.2, 0.9, 1.4, 1.6),
            piece("cupboard", 0.45, 0.9, 0.8, 1.6, height=0.5, z=1.7),
        ],
        "lamps": [{"x": 1.5, "y": 1.5, "z": 2.3}],
        "sources": [[1.5, 1.5], [4, 1]],
    }


def set_(entry: str, **values: Any) -> Change:
    """The change of keys of an entry such as `rooms[0]`."""
    part, index = re.fullmatch(r"(\w+)\[(\d+)\]", entry).groups()  # type: ignore[union-attr]
    return lambda data: data[part][int(index)].update(values)


def add(part: str, *entries: Any) -> Change:
    return lambda data: data[part].extend(entries)


def without(part: str) -> Change:
    return lambda data: data.update({part: []})


def lacks(part: str, index: int) -> Change:
    return lambda data: data[part].pop(index)


def refused(change: Change, folder: Path) -> str:
    data = home()
    change(data)
    path = folder / "home.json"
    path.write_text(json.dumps(data))
    with pytest.raises(UserError) as error:
        load(path)
    line = str(error.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    return line.removeprefix(f"{path}: ")


def test_the_plan_of_these_tests_is_fine(tmp_path: Path) -> None:
    (tmp_path / "home.json").write_text(json.dumps(home()))
    assert len(load(tmp_path / "home.json").rooms) == 3


ROOMS = [
    (set_("rooms[0]", x1=2.5), "rooms[0] (kitchen) and rooms[1] (bedroom) leave a gap at x 2.5"),
    (set_("rooms[1]", x0=4), "rooms[0] (kitchen) and rooms[1] (bedroom) leave a gap at x 3 to 4"),
    (set_("rooms[0]", x1=3.5), "rooms[0] (kitchen) and rooms[1] (bedroom) overlap at x 3 to 3.5"),
    (set_("rooms[2]", y0=3.5), "rooms[0] (kitchen) and rooms[2] (bathroom) leave a gap at y 3"),
    (set_("rooms[2]", y0=2), "rooms[0] (kitchen) and rooms[2] (bathroom) overlap"),
    (add("rooms", room("kitchen", 0, 0, 3, 3)), "rooms[0] (kitchen) and rooms[3] (kitchen) over"),
    (add("rooms", room("kitchen", 1, 1, 2, 2)), "overlap at x 1 to 2, y 1 to 2"),
    (add("rooms", room("bedroom", 6, 0, 9, 3)), "rooms[3] (bedroom) cannot be reached from room"),
    (
        lacks("doorways", 1),
        "rooms[2] (bathroom) cannot be reached from rooms[0] (kitchen); add",
    ),
    (set_("rooms[0]", kind="hall"), "rooms[0]: room kind 'hall' is none of kitchen, bedroom"),
    (set_("rooms[0]", floor="cheese"), "material 'cheese' of 'floor' is not known; use one of par"),
    (set_("rooms[1]", x1=6.2), "rooms[1] (bedroom): 'x1' is 6.2; walls are on the 0.5 m lattice, "),
    (set_("rooms[1]", x1=3), "rooms[1] (bedroom): from x0 to x1 it is 0 m wide, too narrow"),
    (set_("rooms[1]", x1=-3), "rooms[1] (bedroom): from x0 to x1 it is -6 m wide"),
    (set_("rooms[1]", x1=900, y1=900), "the rooms cover"),
    (without("rooms"), "rooms is empty; give at least one room"),
]
OPENINGS = [
    (set_("doorways[0]", x=2.5), "doorways[0] at (2.5, 1.5): lies on no wall shared by two rooms"),
    (set_("doorways[0]", x=6), "doorways[0] at (6, 1.5): lies on no wall shared by two rooms; mov"),
    (set_("doorways[0]", y=3), "doorways[0] at (3, 3): lies on no wall shared by two rooms; move"),
    (set_("doorways[0]", along="x"), "the wall there is parallel to y; set 'along' to 'y'"),
    (set_("doorways[0]", along="z"), "doorways[0] at (3, 1.5): 'along' is 'z', not 'x' or 'y'"),
    (set_("doorways[0]", y=1.3), "doorways[0] at (3, 1.3): is not centred on the 0.5 m lattice"),
    (add("doorways", home()["doorways"][0]), "doorways[0] and doorways[2] overlap at (3, 1.5)"),
    (add("doorways", {"x": 3, "y": 1, "along": "y"}), "place them at least 1 m apart"),
    (set_("windows[0]", y=0.5), "windows[0] at (1.5, 0.5): lies on no outer wall"),
    (set_("windows[0]", x=90), "windows[0] at (90, 0): lies on no outer wall"),
    (set_("windows[0]", x=3), "windows[0] at (3, 0): lies on no outer wall"),  # a wall ends there
    (set_("windows[0]", along="y"), "lies on no outer wall that is parallel to y"),
    (set_("windows[0]", y=3), "lies in the wall between rooms[0] (kitchen) and rooms[2] (bathroo"),
    (set_("windows[0]", x=2.5), "spans x 1.9 to 3.1, more than the outer wall of rooms[0] (kitch"),
    (set_("windows[0]", width=3), "spans x 0 to 3, more than the outer wall"),
    (set_("windows[0]", width=0), "windows[0] at (1.5, 0): 'width' is 0; give at least 0.2 m"),
    (set_("windows[0]", height=-1), "'height' is -1; give at least 0.2 m"),
    (set_("windows[0]", height=2), "reaches from 1 to 3 m; sill and sill + height must be within"),
    (set_("windows[0]", sill=-0.5), "reaches from -0.5 to 0.5 m"),
    (add("windows", home()["windows"][0]), "windows[0] and windows[2] overlap at (1.5, 0)"),
]
CONTENTS = [
    (set_("furniture[0]", x=40), "furniture[0] (sofa) at (40, 0.9): stands outside of every room"),
    (set_("furniture[0]", x=0.3), "is in a wall of rooms[0] (kitchen), whose floor is x 0.05 to 2"),
    (set_("furniture[1]", x=3), "furniture[1] (bed) at (3, 0.9): spans x 2.3 to 3.7"),
    (set_("furniture[0]", kind="piano"), "furniture[0]: kind 'piano' is not known; use the most s"),
    (set_("furniture[0]", kind="piano"), "armchair, basin, bath_cabinet"),
    (set_("furniture[0]", material="cheese"), "material 'cheese' is not known; use one of parquet"),
    (set_("furniture[0]", heading=4), "'heading' is 4; give 0 north, 1 east, 2 south or 3 west"),
    (set_("furniture[0]", width=0), "'width' is 0; give at least 0.01 m"),
    (set_("furniture[0]", height=2.7), "reaches from 0 to 2.7 m; z and z + height must be within"),
    (set_("furniture[2]", z=2.2), "furniture[2] (cupboard) at (0.45, 0.9): reaches from 2.2 to 2"),
    (set_("furniture[2]", z=0.5), "furniture[0] (sofa) at (0.45, 0.9) and furniture[2] (cupboard)"),
    (add("furniture", piece("bed", 5, 1, 0.2, 0.2)), "are in each other; move one"),
    (add("furniture", piece("chair", 2.7, 1.5, 0.4, 0.4)), "blocks doorways[0] at (3, 1.5)"),
    (add("furniture", piece("chair", 3.4, 1.5, 0.4, 0.4)), "blocks doorways[0] at (3, 1.5)"),
    (set_("lamps[0]", x=-4), "lamps[0] at (-4, 1.5): hangs in no room; move it into one"),
    (set_("lamps[0]", z=2.6), "lamps[0] at (1.5, 1.5): 'z' is 2.6; give a height between 0 and 2"),
    (set_("lamps[0]", x=0.5, y=1, z=2), "lamps[0] at (0.5, 1): is in furniture[2] (cupboard)"),
    (add("sources", [0.3, 1]), "sources[2] at (0.3, 1): is not at the centre of a cell"),
    (add("sources", [5, 1]), "sources[2] at (5, 1): is in or within 0.2 m of furniture[1] (bed)"),
    (add("sources", [0, 1]), "sources[2] at (0, 1): is on a wall or outside of every room"),
    (add("sources", [99, 1]), "sources[2] at (99, 1): is on a wall or outside of every room"),
    (add("sources", [4, 1]), "sources[2] at (4, 1): another source is there; move one"),
    (without("sources"), "sources is empty; give at least one"),
    # the last resort: nothing is misplaced, and still a part of the floor is cut off
    (add("furniture", piece("counter", 4.5, 2, 2.9, 0.2)), "cannot be reached from the others"),
]


@pytest.mark.parametrize(("change", "line"), [*ROOMS, *OPENINGS, *CONTENTS])
def test_a_fault_is_named_with_its_entry(change: Change, line: str, tmp_path: Path) -> None:
    assert line in refused(change, tmp_path)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (set_("rooms[0]", x0="0"), "rooms[0]: 'x0' is '0'; give a number from -1000 to 1000"),
        (set_("rooms[0]", x0=True), "rooms[0]: 'x0' is True; give a number"),
        (set_("rooms[0]", x0=None), "rooms[0]: 'x0' is None; give a number"),
        (set_("furniture[0]", x=float("nan")), "furniture[0]: 'x' is nan; give a number"),
        (set_("furniture[0]", x=float("inf")), "furniture[0]: 'x' is inf; give a number"),
        (set_("furniture[0]", x=10**400), "furniture[0]: 'x' is 1000000"),
        (set_("furniture[0]", heading=0.5), "'heading' is 0.5; give a whole number"),
        (set_("rooms[0]", ceiling=2.4), "rooms[0]: 'ceiling' is 2.4; give text in quotes"),
        (set_("rooms[0]", height=2.4), "rooms[0]: unknown key 'height'; delete it, the keys are k"),
        (set_("rooms[0]", **{"a\nb": 1}), "rooms[0]: unknown key 'a\\nb'"),
        (set_("rooms[0]", kind="a\nb"), "room kind 'a\\nb' is none of"),
        (lambda data: data["lamps"][0].pop("z"), "lamps[0]: key 'z' is missing; add it"),
        (add("lamps", 3), "lamps[1]: is 3; give an object with keys"),
        (add("sources", "here"), "sources[2] is 'here'; give [x, y] in metres"),
        (add("sources", [1, 2, 3]), "sources[2] is [1, 2, 3]; give [x, y] in metres"),
        (lambda data: data.update(rooms={}), "'rooms' is {}; give a list"),
        (lambda data: data.update(name=3), "'name' is 3; give text in quotes"),
        (
            lambda data: data.update(ceiling=2),
            "unknown key 'ceiling'; delete it, the keys are",
        ),
        (lambda data: data.pop("windows"), "key 'windows' is missing; add it"),
    ],
)
def test_a_key_or_type_is_named(change: Change, line: str, tmp_path: Path) -> None:
    assert line in refused(change, tmp_path)


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (b"", "not JSON"),
        (b"rooms: []\n", "not JSON"),
        (b"null", "not a floor plan of format 1"),
        (b"\xff\xfe\x00\x81", "not UTF-8 text"),
        (bytes(range(256)), "not UTF-8 text"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"format": 1, "format": 1}', "key 'format' is given twice"),
    ],
)
def test_a_file_that_is_no_plan_is_named(content: bytes, line: str, tmp_path: Path) -> None:
    path = tmp_path / "home.json"
    path.write_bytes(content)
    with pytest.raises(UserError, match=line) as error:
        load(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_a_folder_in_place_of_a_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="Is a directory; give the path of a floor plan"):
        load(tmp_path)


def u_shape(data: Data) -> None:
    data["rooms"] += [room("bathroom", 4.5, 3, 6, 5)]
    data["doorways"] += [{"x": 5.5, "y": 3, "along": "x"}]
    data["windows"].pop()


def one_room(data: Data) -> None:
    data.update(rooms=data["rooms"][:1], doorways=[], furniture=[], sources=[[1, 1]])
    data["windows"].pop()


def of_calculations(data: Data) -> None:
    shift = 0.1 + 0.2 - 0.3  # not zero
    data["rooms"][1]["x0"] += shift
    data["doorways"][0]["x"] += shift
    data["sources"][1][0] += shift


@pytest.mark.parametrize(
    "change",
    [
        u_shape,
        one_room,
        of_calculations,
        without("furniture"),
        without("windows"),
        without("lamps"),
        add("doorways", {"x": 3, "y": 0.5, "along": "y"}),
        set_("windows[0]", width=2.9, sill=0, height=2.6),
        add("furniture", piece("front_door", 0.5, 2.925, 0.9, 0.05)),
        add("furniture", piece("chair", 2.75, 0.9, 0.4, 0.4)),  # beside the doorway
        set_("furniture[0]", heading=1, width=1.6, depth=0.8),
        set_("furniture[0]", heading=2.0),
    ],
)
def test_a_plan_of_another_shape_is_accepted(change: Change, tmp_path: Path) -> None:
    data = home()
    change(data)
    (tmp_path / "home.json").write_text(json.dumps(data))
    plan = load(tmp_path / "home.json")
    assert build_grid(plan).cells > 10
    assert all(isinstance(piece.heading, int) for piece in plan.furniture)


def test_the_apartments_of_the_package_are_accepted() -> None:
    for name in ("var", "mini"):
        values = yaml.safe_load((TOP / "conf" / "split" / f"{name}.yaml").read_text())
        for plan in chain(*load_split(SplitConfig(**values)).values()):
            assert (FROZEN / name / f"{plan.name}.json").read_text() == plan.to_json()
    for size in SIZES:
        check(generate(1, "home", 2, size), size)


def test_the_first_plan_is_not_changed_by_a_check() -> None:
    plan = generate(0, "home", 2, "small")
    before = copy.deepcopy(plan)
    check(plan, "home")
    assert plan == before
    with pytest.raises(UserError, match=r"home: lamps\[0\]"):
        check(FloorPlan(**{**vars(plan), "lamps": (Lamp(90, 0, 1),)}), "home")
