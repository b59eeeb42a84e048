import dataclasses

import numpy as np
import pytest
import torch
from single_episodes import one

from avn.navigation.episodes import exhaustive_episodes
from avn.navigation.navigation_scene import DrawnScene
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator

FORWARD, BACKWARD, LEFT, RIGHT, STOP = range(5)
NORTH, EAST, SOUTH, WEST = range(4)


def act(simulator: Simulator, *actions: int) -> list[bool]:
    """Whether the episode is done after each action."""
    done = []
    for action in actions:
        simulator.step(torch.tensor([action]))
        done.append(bool(simulator.done))
    return done


def counts(simulator: Simulator) -> tuple[int, int, int, int]:
    """Attempted and made moves, collisions, actions."""
    numbers = (simulator.attempted, simulator.moves, simulator.collisions, simulator.actions)
    return tuple(int(number) for number in numbers)  # type: ignore[return-value]


def test_var_succeeds_on_arrival(corridor: DrawnScene, protocols: dict[str, Protocol]) -> None:
    simulator = one(corridor, protocols["var"], 3, WEST)
    assert act(simulator, FORWARD, FORWARD) == [False, True]
    assert simulator.success.item()
    assert counts(simulator) == (2, 2, 0, 2)


def test_backward_moves_against_the_heading_without_turning(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    simulator = one(corridor, protocols["var"], 4, EAST)
    observation = simulator.step(torch.tensor([BACKWARD]))
    assert simulator.state.item() == 4 * 3 + EAST
    assert observation["odometry"].tolist() == [[0, -1, 0]]


def test_a_blocked_move_collides_and_stays(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    simulator = one(corridor, protocols["var"], 5, NORTH)
    assert simulator.step(torch.tensor([FORWARD]))["collided"].tolist() == [True]
    assert simulator.state.item() == 4 * 5 + NORTH
    assert simulator.step(torch.tensor([LEFT]))["collided"].tolist() == [False]
    assert counts(simulator) == (1, 0, 1, 2)


def test_var_ends_at_twice_the_moves_to_the_source_cell(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    # Three moves from the source cell, so that six may be attempted; rotations are free.
    simulator = one(corridor, protocols["var"], 3, NORTH)
    assert not any(act(simulator, *[RIGHT] * 20))
    assert act(simulator, *[FORWARD] * 6) == [False] * 5 + [True]
    assert not simulator.success.item()
    assert counts(simulator) == (6, 0, 6, 26)


def test_arrival_with_the_last_allowed_move_succeeds(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    simulator = one(corridor, protocols["var"], 2, WEST)
    assert act(simulator, BACKWARD, BACKWARD, FORWARD, FORWARD) == [False] * 3 + [True]
    assert not simulator.success.item()
    simulator = one(corridor, protocols["var"], 3, WEST)
    assert act(simulator, BACKWARD, BACKWARD, *[FORWARD] * 4) == [False] * 5 + [True]
    assert simulator.success.item()


@pytest.mark.parametrize("name", ["var", "var_stop", "stop"])
def test_500_actions_of_any_kind_end_an_episode(
    corridor: DrawnScene, protocols: dict[str, Protocol], name: str
) -> None:
    simulator = one(corridor, protocols[name], 5, NORTH)
    assert not any(act(simulator, *[LEFT] * 499))
    assert act(simulator, LEFT) == [True]


def test_var_stop_wants_stop_at_the_goal(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    simulator = one(corridor, protocols["var_stop"], 2, WEST)
    assert act(simulator, FORWARD, STOP) == [False, True]
    assert simulator.success.item()
    assert counts(simulator) == (1, 1, 0, 2)
    simulator = one(corridor, protocols["var_stop"], 2, WEST)
    assert act(simulator, STOP) == [True]
    assert not simulator.success.item()


def test_var_stop_keeps_the_cap_on_moves(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    simulator = one(corridor, protocols["var_stop"], 2, WEST)
    assert act(simulator, FORWARD, FORWARD, FORWARD, FORWARD) == [False] * 3 + [True]
    assert not simulator.success.item()


def test_stop_succeeds_within_a_metre_and_has_no_cap_on_moves(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    simulator = one(corridor, protocols["stop"], 3, WEST)
    assert not any(act(simulator, *[FORWARD] * 40))
    assert act(simulator, BACKWARD, STOP) == [False, True]
    assert simulator.success.item()
    assert counts(simulator) == (41, 4, 37, 42)
    # 1 m from the source is not nearer than 1 m
    simulator = one(corridor, protocols["stop"], 3, WEST)
    assert act(simulator, FORWARD, STOP) == [False, True]
    assert not simulator.success.item()


def test_the_cap_counts_to_the_source_or_to_the_goal(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    # The goal cells are 0 and 1: from cell 2, the source is 2 moves away and the goal 1.
    for cap, most in (("source", 4), ("goal", 2)):
        rules = dataclasses.replace(protocols["var"], cap=cap)
        simulator = one(corridor, rules, 2, NORTH)
        # rotations are free, and blocked moves count
        assert act(simulator, LEFT, RIGHT) == [False, False]
        assert act(simulator, *[FORWARD] * most) == [False] * (most - 1) + [True]
        assert not simulator.success.item()
        # the last move may arrive
        simulator = one(corridor, rules, 2, NORTH)
        act(simulator, *[FORWARD] * (most - 1), LEFT)
        assert act(simulator, FORWARD) == [True]
        assert simulator.success.item()
    far = one(corridor, dataclasses.replace(protocols["var"], cap="goal"), 10, WEST)
    assert far.max_attempts.tolist() == [18]


@pytest.mark.parametrize(
    ("cap", "heading", "wanted"), [("goal", WEST, 7 / 18), ("goal", NORTH, 5 / 18)]
)
def test_a_random_walk_next_to_the_goal_succeeds_as_computed_by_hand(
    corridor: DrawnScene, protocols: dict[str, Protocol], cap: str, heading: int, wanted: float
) -> None:
    # Two attempted moves. A move goes along the axis of the last one with probability 2/3, and
    # either way along it; north and south are blocked, and a move to the east is too far.
    rules = dataclasses.replace(protocols["var"], cap=cap)
    count = 20_000
    episodes = dataclasses.replace(
        exhaustive_episodes(corridor, ["ring"], rules, seed=0),
        **{name: np.zeros(count, dtype=np.int64) for name in ("number", "sound", "source")},
        start=np.full(count, 4 * 2 + heading),
        trajectory_index=np.full(count, -1),
    )
    simulator = Simulator(corridor, episodes, rules)
    generator = torch.Generator().manual_seed(0)
    while not bool(simulator.done.all()):
        simulator.step(torch.randint(4, (count,), generator=generator))
    rate = float(simulator.success.double().mean())
    assert rate == pytest.approx(wanted, abs=4 * (wanted * (1 - wanted) / count) ** 0.5)


def test_a_finished_episode_stands_still(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    simulator = one(corridor, protocols["var"], 2, WEST)
    act(simulator, FORWARD, FORWARD, BACKWARD, LEFT)
    assert simulator.state.item() == 4 * 1 + WEST
    assert counts(simulator) == (1, 1, 0, 1)
    assert simulator.success.item()


def test_reset_begins_anew(two_rooms: DrawnScene, protocols: dict[str, Protocol]) -> None:
    episodes = exhaustive_episodes(two_rooms, ["ring"], protocols["var"], seed=0)
    simulator = Simulator(two_rooms, episodes, protocols["var"])
    for action in (FORWARD, LEFT, FORWARD):
        simulator.step(torch.full((len(episodes),), action))
    observation = simulator.reset()
    assert (simulator.state == torch.from_numpy(episodes.start)).all()
    assert not observation["odometry"].any()
    assert not simulator.done.any()
    assert not simulator.actions.any()


def test_wrong_actions_are_refused(corridor: DrawnScene, protocols: dict[str, Protocol]) -> None:
    simulator = one(corridor, protocols["var"], 5, NORTH)
    with pytest.raises(ValueError, match="Stop is not an action under protocol 'var'"):
        simulator.step(torch.tensor([STOP]))
    with pytest.raises(ValueError, match="7 is no action"):
        simulator.step(torch.tensor([7]))
    with pytest.raises(ValueError, match="wanted"):
        simulator.step(torch.tensor([0, 0]))
    with pytest.raises(ValueError, match="int64"):
        simulator.step(torch.tensor([0.0]))
    assert counts(simulator) == (0, 0, 0, 0)
