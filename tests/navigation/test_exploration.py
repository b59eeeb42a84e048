import numpy as np
import pytest

from avn.core.actions import FORWARD, ROTATE_LEFT, ROTATE_RIGHT, transitions
from avn.core.random import derive, scramble
from avn.navigation.exploration import explore, first_visits
from avn.navigation.navigation_scene import DrawnScene


def test_every_step_is_an_unblocked_action_with_the_right_chance(two_rooms: DrawnScene) -> None:
    neighbours = two_rooms.grid.neighbours
    trajectories = explore(neighbours, scramble(derive("test"), np.arange(200)), 400)
    table = transitions(neighbours)
    before, after = trajectories[:, :-1], trajectories[:, 1:]
    taken = {action: table[before, action] == after for action in (ROTATE_LEFT, ROTATE_RIGHT)}
    taken[FORWARD] = (table[before, FORWARD] == after) & (after != before)
    assert (sum(hits.astype(int) for hits in taken.values()) == 1).all()
    blocked = table[before, FORWARD] == before
    assert taken[FORWARD][~blocked].mean() == pytest.approx(2 / 3, abs=0.01)
    assert taken[ROTATE_LEFT][~blocked].mean() == pytest.approx(1 / 6, abs=0.01)
    assert taken[ROTATE_LEFT][blocked].mean() == pytest.approx(1 / 2, abs=0.01)


def test_first_visits() -> None:
    trajectories = np.array([[4, 0, 5, 8]])
    assert first_visits(trajectories, 4).tolist() == [[1, 0, 3, 4]]
