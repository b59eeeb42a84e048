import dataclasses
from contextlib import nullcontext
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import torch

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
    assert goals(scene, protocols["stop"]) == [{(1, 0), (0, 0)}]
    wide = dataclasses.replace(protocols["stop"], radius=2.0)
    assert goals(scene, wide) == [{(1, 0), (0, 0), (0, 1), (0, 2)}]


def test_radius_is_measured_along_the_walk(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    nearer = {(x, y) for x in range(11) for y in range(5) if abs(x - 9) + abs(y - 2) < 2}
    assert len(nearer) == 5
    assert goals(two_rooms, protocols["stop"])[0] == nearer


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
        ("radius", 0.0),
        ("radius", float("nan")),
        ("cap", "goals"),
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


@pytest.mark.parametrize("radius", [0.1, 0.5, 0.75, 1.0, 1.25, 0.1 * 15, 1.5, 2.9, 3.0, 50.0])
def test_cells_at_the_radius_are_outside_as_in_habitat(radius: float) -> None:
    # Habitat's measure of success is `distance_to_target < success_distance`. 0.1 * 15 is rounded
    # to more than 1.5, and means 1.5 all the same.
    scene = draw("corridor", "A" + 10 * "a")
    rules = Protocol("wide", "radius", True, "metres", radius=radius)
    wanted = [i for i in range(11) if Fraction(i, 2) < Fraction(radius).limit_denominator(1000)]
    assert np.flatnonzero(rules.goal_cells(scene.grid, scene.sources)[0]).tolist() == wanted


@pytest.mark.parametrize(
    ("rules", "refused"),
    [
        ({"goal": "box", "requires_stop": True, "cap": "goal"}, True),
        ({"goal": "radius", "radius": 0.5, "requires_stop": True}, True),
        ({"goal": "radius", "radius": 1.0, "requires_stop": True}, False),
        ({"goal": "box", "requires_stop": True}, False),
        ({"goal": "box", "requires_stop": False, "cap": "goal"}, False),
    ],
)
def test_a_cap_that_leaves_no_stop_is_refused(rules: dict[str, Any], refused: bool) -> None:
    expected = pytest.raises(UserError, match=r"max_moves_ratio: 1\.0, so that an episode ends")
    with expected if refused else nullcontext():
        Protocol(name="x", path_length="moves", max_moves_ratio=1.0, **rules)


def test_a_limit_is_a_multiple_of_the_moves_rounded_up() -> None:
    rules = Protocol("x", "box", False, "moves", max_moves_ratio=1.1)
    # 1.1 * 10 is rounded to more than 11, and means 11 all the same
    assert rules.most_moves(torch.tensor([0, 1, 5, 10, 11])).tolist() == [0, 2, 6, 11, 13]
