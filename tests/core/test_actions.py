from avn.core.actions import BACKWARD, FORWARD, ROTATE_LEFT, ROTATE_RIGHT, STOP, transitions
from avn.navigation.navigation_scene import draw


def test_where_each_action_leads() -> None:
    # Cells 0 and 1 below, 2 above 0.
    table = transitions(draw("l", "a#\nAa").grid.neighbours)
    north, east, south, west = range(4)
    assert table[4 * 0 + north, FORWARD] == 4 * 2 + north
    assert table[4 * 0 + east, FORWARD] == 4 * 1 + east
    assert table[4 * 0 + west, BACKWARD] == 4 * 1 + west
    assert table[4 * 2 + north, BACKWARD] == 4 * 0 + north
    assert table[4 * 0 + south, FORWARD] == 4 * 0 + south
    assert table[4 * 1 + north, ROTATE_LEFT] == 4 * 1 + west
    assert table[4 * 1 + west, ROTATE_RIGHT] == 4 * 1 + north
    assert (table[:, STOP] == range(12)).all()
