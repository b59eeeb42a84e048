"""The exact odds of the random walk against playing it out, and the frozen benchmark."""

from __future__ import annotations

import numpy as np
import pytest
from hardness import hardness, random_walk_odds

from avn.apartments.floor_plan import Doorway, FloorPlan, Room
from avn.apartments.grid import build_grid, goal_cells
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import load_split

FINISH = {"floor": "parquet", "walls": "plaster", "ceiling": "ceiling_plaster"}


def corridor(length: int) -> FloorPlan:
    """A single row of `length` cells, source on the westernmost."""
    room = Room("kitchen", 0.0, 0.0, 0.5 * (length + 1), 1.0, **FINISH)
    return FloorPlan("corridor", (room,), (), sources=((0.5, 0.5),))


def test_by_hand_in_a_corridor() -> None:
    """Three cells in a row, source on the first, start on the third.

    It is two moves from the source, so that there are four attempts, and one from the goal:
    any move to the west succeeds and all others leave the agent where it is.
    """
    grid = build_grid(corridor(3))
    success, spl, start = random_walk_odds(grid, 0)
    assert start.tolist() == [False, False, True]
    # Axis along (a) or across (x) before each of 4 attempts; west succeeds, all else stays.
    along, across, expected, weighted = 0.5, 0.5, 0.0, 0.0
    for attempt in (1, 2, 3, 4):
        hit = along / 2
        expected += hit
        weighted += hit / attempt
        along -= hit
        along, across = 2 / 3 * along + 1 / 3 * across, 1 / 3 * along + 2 / 3 * across
    assert success[2] == pytest.approx(expected)
    assert spl[2] == pytest.approx(weighted)


@pytest.mark.parametrize("cap", ["source", "goal"])
def test_against_playing_it_out(cap: str) -> None:
    rooms = (
        Room("kitchen", 0.0, 0.0, 3.0, 2.5, **FINISH),
        Room("bedroom", 3.0, 0.0, 5.5, 2.5, **FINISH),
    )
    plan = FloorPlan("two", rooms, (Doorway(3.0, 1.0, "y"),), sources=((1.0, 1.0),))
    grid = build_grid(plan)
    source = grid.lattice.tolist().index([2, 2])
    success, spl, start = random_walk_odds(grid, source, cap)
    goal = goal_cells(grid)[source]
    rng = np.random.default_rng(0)
    first = np.repeat(np.flatnonzero(start), 4 * 400)
    cell, heading = first.copy(), np.tile(np.repeat(np.arange(4), 400), start.sum())
    moves, score = np.zeros(len(cell), dtype=int), np.zeros(len(cell))
    live = np.ones(len(cell), dtype=bool)
    shortest = grid.distances[:, goal].min(axis=1)[first]
    limit = 2 * (shortest if cap == "goal" else grid.distances[first, source])
    for _ in range(200):
        action = rng.integers(4, size=len(cell))
        heading = np.where(live, (heading + (action == 3) - (action == 2)) % 4, heading)
        moving = live & (action < 2)
        ahead = grid.neighbours[cell, (heading + 2 * (action == 1)) % 4]
        cell = np.where(moving & (ahead >= 0), ahead, cell)
        moves += moving
        hit = moving & goal[cell]
        score[hit] = shortest[hit] / np.maximum(moves, shortest)[hit]
        live &= ~hit & (moves < limit)
    assert not live.any()
    assert success[start].mean() == pytest.approx((score > 0).mean(), abs=0.01)
    assert spl[start].mean() == pytest.approx(score.mean(), abs=0.008)


def test_the_benchmark_is_as_hard_as_the_papers() -> None:
    """Random search is 7.1 / 4.3 in the paper, averaged over rooms and sounds."""
    rooms = [
        hardness(plan, build_grid(plan)) for plan in load_split(SplitConfig(folder="var"))["test"]
    ]
    assert 100 * np.mean([room.success for room in rooms]) == pytest.approx(7.1, abs=1.5)
    assert 100 * np.mean([room.spl for room in rooms]) == pytest.approx(4.3, abs=1.0)
    # Not easy by other measures either: most starts are elsewhere, unseen, and far to walk.
    assert np.mean([room.other_room for room in rooms]) > 0.6
    assert np.mean([room.out_of_sight for room in rooms]) > 0.5
    assert np.mean([room.detour for room in rooms]) > 1.4
