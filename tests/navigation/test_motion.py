"""Sources walk along shortest paths to random squares, and are caught as early as can be."""

from collections import deque

import numpy as np
import pytest
from small_places import TWO_ROOMS

from avn.core.actions import transitions
from avn.core.errors import UserError
from avn.core.random import derive, scramble
from avn.navigation.motion import Motion, earliest_catch
from avn.navigation.navigation_scene import draw

KEYS = scramble(derive("test"), np.arange(4000))
CORRIDOR = draw("corridor", "A" + 10 * "a").grid
ROOMS = draw("two_rooms", TWO_ROOMS)


def walks(step=0.3, grid=ROOMS.grid, keys=KEYS, actions=40, cell=0):
    return Motion(step).walk(keys, np.full(len(keys), cell), grid, actions).astype(int)


def test_it_steps_to_a_free_square_beside_it_with_the_probability():
    found = walks(0.3)
    assert (found[:, 0] == 0).all()
    here, there = found[:, :-1].ravel(), found[:, 1:].ravel()
    moves = here != there
    assert (ROOMS.grid.neighbours[here[moves]] == there[moves, None]).any(axis=1).all()
    count = moves.size
    assert abs(moves.mean() - 0.3) < 4 * np.sqrt(0.3 * 0.7 / count)
    # at every action alike
    assert np.abs(moves.reshape(len(KEYS), -1).mean(0) - 0.3).max() < 0.035


def test_it_goes_the_shortest_way_to_ends_that_are_drawn_uniformly():
    # Without a turn from the first to the last of eleven cells: the end is one of those ahead,
    # each with probability 1 / 10, and at an end the next one is drawn.
    straight = np.ones(11)
    for cell in range(9, -1, -1):
        straight[cell] = straight[cell + 1 :].sum() / 10
    found = walks(1.0, CORRIDOR, actions=10)
    share = (found[:, 10] == 10).mean()
    assert abs(share - straight[0]) < 4 * np.sqrt(straight[0] / len(KEYS))
    assert (np.abs(np.diff(found, axis=1)) == 1).all(), "it never waits with probability 1"


def test_it_stays_where_there_is_no_other_square():
    assert (walks(1.0, draw("one", "A").grid) == 0).all()


def test_it_goes_everywhere():
    found = walks(1.0, actions=400)[:100]
    assert set(found.ravel()) == set(range(ROOMS.grid.cells))


def test_a_walk_depends_on_its_own_key_and_on_no_number_of_actions():
    whole = walks()
    assert (walks(keys=KEYS[5:9]) == whole[5:9]).all()
    assert (walks(actions=7) == whole[:, :8]).all()
    assert len({tuple(walk) for walk in whole[:200]}) > 190


def test_with_probability_0_it_stays():
    assert (walks(0.0, cell=7) == 7).all()


@pytest.mark.parametrize("step", [-0.1, 1.1, float("nan")])
def test_values_out_of_range_are_named(step):
    with pytest.raises(UserError, match=r"motion\.step"):
        Motion(step)


def searched(following, goal, walk, start):
    """The fewest actions by breadth-first search over states and times."""
    reached, seen = deque([(start, 0)]), {(start, 0)}
    while reached:
        state, time = reached.popleft()
        if goal[walk[time], state // 4]:
            return time
        for action in range(4):
            after = (int(following[state, action]), time + 1)
            if after[1] < len(walk) and after not in seen:
                seen.add(after)
                reached.append(after)
    return len(walk)


@pytest.mark.parametrize(("near", "step"), [(0, 0.3), (1, 0.3), (0, 0.9), (2, 0.0)])
def test_the_earliest_catch_is_that_of_a_search_over_space_and_time(near, step):
    grid = ROOMS.grid
    goal = grid.distances <= near
    following = transitions(grid.neighbours)
    walk = walks(step, keys=KEYS[:40], actions=25, cell=3)
    start = np.random.default_rng(0).integers(4 * grid.cells, size=len(walk))
    actions, cell = earliest_catch(grid, goal, walk, start)
    expected = [searched(following, goal, *own) for own in zip(walk, start, strict=True)]
    assert actions.tolist() == expected
    assert len(set(expected)) > 4
    in_time = actions < 26
    assert goal[walk[in_time, actions[in_time]], cell[in_time]].all()


def test_one_that_cannot_be_caught_in_time_takes_more_than_all_actions():
    grid = CORRIDOR
    walk = walks(0.0, grid, KEYS[:1], actions=4, cell=10)
    actions, _ = earliest_catch(grid, np.eye(11, dtype=bool), walk, np.array([0]))
    assert actions.tolist() == [5]
