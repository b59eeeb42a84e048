"""Fixtures: small apartments and the three protocols, drawn by hand."""

import pytest

from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.protocols import Protocol

# Two rooms with a doorway (the `a` in the wall), and a source in each.
TWO_ROOMS = """
aaaaa#bbbbb
aAaaa#bbbbb
aaaaaabbbBb
aaaaa#bbbbb
aaaaa#bbbbb
"""


@pytest.fixture
def two_rooms() -> DrawnScene:
    return draw("two_rooms", TWO_ROOMS)


@pytest.fixture
def corridor() -> DrawnScene:
    """Eleven cells from west to east, the source on the first."""
    return draw("corridor", "A" + 10 * "a")


@pytest.fixture
def protocols() -> dict[str, Protocol]:
    return {
        "var": Protocol("var", "box", False, "moves", max_moves_ratio=2.0, exploration_steps=0),
        "var_stop": Protocol(
            "var_stop", "box", True, "moves", max_moves_ratio=2.0, exploration_steps=0
        ),
        "stop": Protocol("stop", "radius", True, "metres", exploration_steps=0),
    }
