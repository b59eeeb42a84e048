"""Copies are found whatever way they are turned."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain, combinations

import pytest

from avn.apartments.floor_plan import Doorway, FloorPlan
from avn.apartments.generator import generate
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import load_split
from avn.apartments.symmetry import layout_key, layout_similarity


def turned(plan: FloorPlan, turn: int) -> FloorPlan:
    """The plan mirrored (bit 0), then turned clockwise `turn >> 1` times, and shifted."""

    def point(x: float, y: float) -> tuple[float, float]:
        x = -x if turn & 1 else x
        for _ in range(turn >> 1):
            x, y = y, -x
        return x + 7.5, y - 3.0

    rooms = []
    for room in plan.rooms:
        (ax, ay), (bx, by) = point(room.x0, room.y0), point(room.x1, room.y1)
        rooms.append(replace(room, x0=min(ax, bx), y0=min(ay, by), x1=max(ax, bx), y1=max(ay, by)))
    doors = []
    for door in plan.doorways:
        along = {"x": "y", "y": "x"}[door.along] if (turn >> 1) % 2 else door.along
        doors.append(Doorway(*point(door.x, door.y), along))
    return FloorPlan(plan.name, tuple(rooms[::-1]), tuple(doors))


@pytest.mark.parametrize("turn", range(8))
def test_copies_have_one_key(turn: int) -> None:
    plan = generate(5, "home")
    assert layout_key(turned(plan, turn)) == layout_key(plan)
    assert layout_similarity(turned(plan, turn), plan) == 1.0


def test_other_layouts_have_another_key() -> None:
    plan = generate(5, "home")
    door = plan.doorways[0]
    dx, dy = (0.5, 0.0) if door.along == "x" else (0.0, 0.5)
    moved = replace(door, x=door.x + dx, y=door.y + dy)
    assert layout_key(replace(plan, doorways=(moved, *plan.doorways[1:]))) != layout_key(plan)
    other = replace(
        plan.rooms[0], kind="kitchen" if plan.rooms[0].kind != "kitchen" else "bathroom"
    )
    assert layout_key(replace(plan, rooms=(other, *plan.rooms[1:]))) != layout_key(plan)


def test_likeness_sees_what_differs() -> None:
    plan = generate(5, "home")
    other = replace(
        plan.rooms[0], kind="kitchen" if plan.rooms[0].kind != "kitchen" else "bathroom"
    )
    repainted = replace(plan, rooms=(other, *plan.rooms[1:]))
    squares = [round(4 * (r.x1 - r.x0 - 0.5) * (r.y1 - r.y0 - 0.5)) for r in plan.rooms]
    # All but the first room is the same.
    expected = 1 - squares[0] / (sum(squares) + len(plan.doorways))
    assert layout_similarity(plan, repainted) == pytest.approx(expected, abs=0.03)


def test_no_two_frozen_apartments_look_alike() -> None:
    plans = list(chain(*load_split(SplitConfig(folder="var")).values()))
    assert len(plans) == 10
    assert max(layout_similarity(a, b) for a, b in combinations(plans, 2)) <= 0.7
