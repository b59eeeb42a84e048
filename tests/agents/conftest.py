"""A hand-drawn apartment and the three protocols."""

import pytest
from small_places import corridor, protocols, two_rooms

from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.protocols import Protocol

__all__ = ["corridor", "flat", "hall", "protocol", "protocols", "two_rooms"]

THREE_ROOMS = """
aaaaa#bbbbbbb
aAaaa#bbbbb#b
aaaaaaabbbb#b
aa#aa#bbbbB#b
aa#aa#bbbb##b
###a####b####
cccccc#cccccc
ccCccccccccCc
cccc##ccccccc
"""


@pytest.fixture
def flat() -> DrawnScene:
    return draw("flat", THREE_ROOMS)


@pytest.fixture
def hall() -> DrawnScene:
    """One empty room, so that nothing is in the way."""
    return draw("hall", "\n".join(["a" * 15] * 7 + ["a" * 7 + "A" + "a" * 7] + ["a" * 15] * 7))


@pytest.fixture(params=["var", "var_stop", "stop"])
def protocol(request: pytest.FixtureRequest) -> Protocol:
    return {
        "var": Protocol("var", "box", False, "moves", max_moves_ratio=2.0),
        "var_stop": Protocol("var_stop", "box", True, "moves", max_moves_ratio=2.0),
        "stop": Protocol("stop", "radius", True, "metres"),
    }[request.param]
