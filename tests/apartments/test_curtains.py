"""Curtains hang beside windows, where nothing is in their way."""

from __future__ import annotations

from dataclasses import replace

import pytest

from avn.apartments.curtains import hang_curtains
from avn.apartments.floor_plan import Doorway, FloorPlan, Lamp, Piece, Room, Window
from avn.apartments.floor_plan_checks import check
from avn.apartments.grid import build_grid

FINISH = ("parquet", "plaster", "ceiling_plaster")
PLAN = FloorPlan(
    "flat",
    (
        Room("bedroom", 0.0, 0.0, 4.0, 4.0, *FINISH),
        Room("bathroom", 4.0, 0.0, 6.0, 4.0, *FINISH),
    ),
    (Doorway(4.0, 2.0, "y"),),
    (Window(2.0, 0.0, "x", 1.4, 0.9, 1.3), Window(6.0, 2.0, "y", 0.6, 1.5, 0.6)),
    lamps=(Lamp(2.0, 2.0, 2.35),),
    sources=((1.0, 1.0),),
)


class Always:
    """Numbers that hang the widest curtains at each window that may have some."""

    def random(self) -> float:
        return 0.0

    def integers(self, low: int, high: int | None = None) -> int:
        return 0


class Never(Always):
    def random(self) -> float:
        return 0.999


def hung(plan: FloorPlan, rng: Always | None = None) -> list[Piece]:
    made = hang_curtains(plan, rng or Always())  # type: ignore[arg-type]
    check(made, "flat")
    curtains = [piece for piece in made.furniture if piece.kind == "curtain"]
    assert made.furniture[: len(plan.furniture)] == plan.furniture
    return curtains


def test_two_curtains_hang_at_a_window_of_a_bedroom_and_none_in_the_bathroom() -> None:
    left, right = hung(PLAN)
    assert left.bounds == pytest.approx((0.7, 0.05, 1.3, 0.15))
    assert right.bounds == pytest.approx((2.7, 0.05, 3.3, 0.15))
    assert {(c.z, c.height, c.heading, c.material) for c in (left, right)} == {
        (0.02, 2.48, 0, "fabric")
    }
    assert hung(PLAN, Never()) == []


@pytest.mark.parametrize(
    ("window", "heading"),
    [
        (Window(2.0, 4.0, "x", 1.4, 0.9, 1.3), 2),
        (Window(0.0, 2.0, "y", 1.4, 0.9, 1.3), 1),
    ],
)
def test_curtains_have_their_back_at_the_wall(window: Window, heading: int) -> None:
    curtains = hung(replace(PLAN, windows=(window,)))
    assert [curtain.heading for curtain in curtains] == [heading, heading]
    for curtain in curtains:
        x0, _, _, y1 = curtain.bounds
        back = {2: y1 - 3.95, 1: x0 - 0.05}[heading]
        assert back == pytest.approx(0.0)


def test_a_curtain_is_short_above_low_furniture_and_absent_before_high_one() -> None:
    low = Piece("dresser", 1.0, 0.275, 0.9, 0.45, 0.6, 0, "wood")
    short, long = hung(replace(PLAN, furniture=(low,)))
    assert (short.z, long.z) == (0.7, 0.02)
    assert short.z + short.height == pytest.approx(2.5)
    high = Piece("wardrobe", 0.8, 0.35, 1.0, 0.6, 2.1, 0, "wood")
    (only,) = hung(replace(PLAN, furniture=(high,)))
    assert only.x > 2.0


def test_a_curtain_is_narrow_in_a_corner_and_not_swept_by_a_door() -> None:
    aside = replace(PLAN, windows=(Window(1.15, 0.0, "x", 1.4, 0.9, 1.3),))
    left, right = hung(aside)
    assert (left.width, right.width) == (0.4, 0.6)
    door = replace(PLAN, doorways=(Doorway(4.0, 0.5, "y"),))
    _, beside = hung(door)
    assert beside.bounds[2] <= 4.0 - 0.95 + 1e-9
    assert beside.width == 0.3


def test_curtains_block_no_cell() -> None:
    with_curtains = hang_curtains(PLAN, Always())  # type: ignore[arg-type]
    assert build_grid(with_curtains).cells == build_grid(PLAN).cells
