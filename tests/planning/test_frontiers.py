"""Frontiers of maps drawn by hand: `.` is free, `#` blocked, a space unknown, `@` the agent."""

import numpy as np
import pytest

from avn.planning.frontiers import frontiers_towards

ALL = np.array([True])


def parsed(drawing):
    """Probabilities, walls and position of a drawing whose first line lies in the north."""
    rows = drawing.strip("\n").splitlines()[::-1]
    width = max(map(len, rows))
    squares = np.array([list(row.ljust(width)) for row in rows])
    size = max(squares.shape)
    belief = np.full((1, size, size), 0.5, np.float32)
    for mark, p in ((".", 0.9), ("@", 1.0), ("#", 0.1)):
        belief[0, : len(rows), :width][squares == mark] = p
    y, x = np.argwhere(squares == "@")[0]
    return belief, np.zeros(belief.shape, np.uint8), np.array([(x, y)])


def chosen(drawing, degrees, sector=10.0, walls=None):
    belief, none, position = parsed(drawing)
    turns, sector = np.array([degrees / 360]), sector / 360
    found = frontiers_towards(
        belief, none if walls is None else walls, position, turns, sector, ALL
    )
    beyond, there = found
    return tuple((beyond - position)[0].tolist()) if there[0] else None


# A room that is open in the north and in the east; in the south, a free square behind blocked ones.
ROOM = """
### #####
##.....##
#.......#
#...@...
#########
   .
"""


@pytest.mark.parametrize(
    ("degrees", "offset"), [(0, (-1, 3)), (340, (-1, 3)), (60, (4, 0)), (90, (4, 0))]
)
def test_the_frontier_in_the_direction_is_found(degrees, offset):
    assert chosen(ROOM, degrees) == offset


def test_behind_blocked_squares_there_is_no_frontier():
    # the free square in the south borders unknown ones, but no walk leads to it
    assert chosen(ROOM, 180) == (4, 0)
    closed = "#####\n#.@.#\n#####\n  .\n"
    assert chosen(closed, 0) is None


def test_a_wall_between_two_free_squares_is_no_way():
    drawing = "####\n#@. \n####"
    assert chosen(drawing, 90) == (2, 0)
    _, walls, (position,) = parsed(drawing)
    walls[0, position[1], position[0]] = 1 << 1
    assert chosen(drawing, 90, walls=walls) is None


def test_the_own_frontier_has_the_direction_of_what_is_unknown():
    beside = {0: (0, 1), 90: (1, 0), 180: (0, -1), 270: (-1, 0)}
    for degrees, offset in beside.items():
        belief = np.full((1, 5, 5), 0.5, np.float32)
        belief[0, 2, 2] = 1
        walls, position = np.zeros((1, 5, 5), np.uint8), np.array([(2, 2)])
        beyond, found = frontiers_towards(
            belief, walls, position, np.array([degrees / 360]), 0.01, ALL
        )
        assert found[0]
        assert tuple(beyond[0] - 2) == offset


def test_within_a_sector_the_fewest_moves_decide():
    # unknown ahead at six moves, and somewhat to the right at three
    drawing = """
## ##
##.##
##.##
##.##
##..
##.##
##@##
#####
"""
    assert chosen(drawing, 0, sector=10) == (0, 6)
    assert chosen(drawing, 0, sector=60) == (2, 2)


def test_each_agent_of_a_batch_has_its_own_and_others_keep_their_place():
    belief, walls, position = parsed(ROOM)
    many = [np.repeat(own, 3, 0) for own in (belief, walls, position)]
    turns, active = np.array([0.0, 0.25, 0.25]), np.array([True, True, False])
    beyond, found = frontiers_towards(*many, turns, 10 / 360, active)
    assert found.tolist() == [True, True, False]
    assert not np.array_equal(beyond[0], beyond[1])
    assert np.array_equal(beyond[2], position[0])
