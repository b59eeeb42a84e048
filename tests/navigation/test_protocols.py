from typing import Any

import numpy as np
import pytest

from avn.core.errors import UserError
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.protocols import Protocol


def goals(scene: DrawnScene, protocol: Protocol) -> list[set[tuple[int, int]]]:
    cells = protocol.goal_cells(scene.grid, scene.sources)
    return [{tuple(xy) for xy in scene.grid.lattice[own].tolist()} for own in cells]


def test_box_is_the_nine_cells_around_the_source(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    wanted = {(x, y) for x in (8, 9, 10) for y in (1, 2, 3)}
    assert goals(two_rooms, protocols["var"])[0] == wanted
    assert goals(two_rooms, protocols["var_stop"])[0] == wanted


def test_box_does_not_pass_through_walls(protocols: dict[str, Protocol]) -> None:
    # The free cell at (2, 1) touches the source at (1, 0) by a corner, and is six moves away.
    scene = draw("bend", "aaaa\na#aa\naA#a")
    assert goals(scene, protocols["var"]) == [{(1, 0), (0, 0), (0, 1)}]
    assert goals(scene, protocols["stop"]) == [{(1, 0), (0, 0), (0, 1)}]


def test_radius_is_measured_along_the_walk(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    within = {(x, y) for x in range(11) for y in range(5) if abs(x - 9) + abs(y - 2) <= 2}
    assert goals(two_rooms, protocols["stop"])[0] == within


def test_stop_is_an_action_only_where_the_protocol_has_it(protocols: dict[str, Protocol]) -> None:
    assert {name: rules.actions for name, rules in protocols.items()} == {
        "var": 4,
        "var_stop": 5,
        "stop": 5,
    }


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("goal", "bow"),
        ("path_length", "walked"),
        ("radius", -1.0),
        ("max_moves_ratio", 0.5),
        ("max_actions", 0),
        ("num_starts", 0),
        ("exploration_steps", -1),
    ],
)
def test_wrong_rules_name_their_key(key: str, value: Any) -> None:
    rules = {"name": "x", "goal": "box", "requires_stop": False, "path_length": "moves", key: value}
    with pytest.raises(UserError, match=f"protocol.{key}"):
        Protocol(**rules)


def test_radius_keeps_cells_that_lie_on_it() -> None:
    scene = draw("corridor", "A" + 10 * "a")
    rules = Protocol("wide", "radius", True, "metres", radius=1.5)
    assert np.flatnonzero(rules.goal_cells(scene.grid, scene.sources)[0]).tolist() == [0, 1, 2, 3]
