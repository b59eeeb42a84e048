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

# Two rooms, a wall between them with one doorway, and a dead end on the straight way.
FLAT = """
aaaaaaa#bbbbbbbb
aaaaaaa#bbbbbbbb
aaaa#####bbbbbbb
aaaa#aa#bbbbbBbb
aaaaaaa#bbbbbbbb
aaaaaaaabbbbbbbb
aaaaaaa#bbbbbbbb
"""
VAR = Protocol(
    name="var",
    goal="box",
    requires_stop=False,
    path_length="moves",
    max_moves_ratio=2.0,
    exploration_steps=0,
)
STOP = Protocol(
    name="stop", goal="radius", requires_stop=True, path_length="metres", exploration_steps=0
)


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
