import dataclasses

import pytest

from avn.agents.oracle import Oracle
from avn.agents.rollout import Labels, rollout_scene
from avn.navigation.dynamics import Dynamics
from avn.navigation.episodes import exhaustive_episodes
from avn.navigation.motion import Motion
from avn.navigation.navigation_scene import DrawnScene
from avn.navigation.protocols import Protocol

LABELS = Labels("oracle", "resonance")


def test_oracle_is_perfect_from_every_start(flat: DrawnScene, protocol: Protocol) -> None:
    episodes = exhaustive_episodes(flat, ["ring"], protocol, seed=0)
    frame = rollout_scene(Oracle(), flat, episodes, protocol, LABELS)
    assert len(frame) > 1000
    assert (frame["success"] == 1).all()
    assert (frame["spl"] == 1.0).all()
    assert (frame["sna"] == 1.0).all()
    assert (frame["actions"] == frame["fewest_actions"]).all()
    assert (frame["collisions"] == 0).all()
    if protocol.path_length == "moves":
        assert (frame["softspl"] == 1.0).all()


def test_oracle_does_not_go_round_to_save_turns(flat: DrawnScene, protocol: Protocol) -> None:
    # However wide the goal is, the walk is never longer than the shortest one to the source.
    wide = dataclasses.replace(protocol, goal="radius", radius=1.5, path_length="metres")
    episodes = exhaustive_episodes(flat, ["ring"], wide, seed=0)
    frame = rollout_scene(Oracle(), flat, episodes, wide, LABELS)
    assert (frame["path_length"] <= frame["geodesic"]).all()
    assert (frame["spl"] == 1.0).all()


@pytest.mark.parametrize("ratio", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("path_length", ["moves", "metres"])
@pytest.mark.parametrize("goal", ["box", "radius"])
def test_oracle_arrives_before_the_cap(
    flat: DrawnScene, protocol: Protocol, goal: str, path_length: str, ratio: float
) -> None:
    for cap in ("source", "goal") if ratio > 1 or not protocol.requires_stop else ("source",):
        rules = dataclasses.replace(
            protocol,
            goal=goal,
            radius=2.5,
            path_length=path_length,
            max_moves_ratio=ratio,
            cap=cap,
        )
        episodes = exhaustive_episodes(flat, ["ring"], rules, seed=0)
        frame = rollout_scene(Oracle(), flat, episodes, rules, LABELS)
        assert (frame["success"] == 1).all()
        assert (frame["spl"] == 1.0).all()
        assert (frame["actions"] == frame["fewest_actions"]).all()


def test_oracle_catches_a_walking_source_as_early_as_can_be(flat, protocol) -> None:
    rules = dataclasses.replace(protocol, max_moves_ratio=None)
    episodes = exhaustive_episodes(flat, ["ring"], rules, seed=0)
    walking = Dynamics(motion=Motion(0.6))
    frame = rollout_scene(Oracle(), flat, episodes, rules, LABELS, dynamics=walking)
    assert (frame["success"] == 1).all()
    assert (frame["dspl"] == 1.0).all()
    assert (frame["actions"] == frame["fewest_actions_to_catch"]).all()
    assert (frame["collisions"] == 0).all()
    before = frame["fewest_actions_to_catch"] < frame["fewest_actions"]
    assert before.any(), "some sources come to meet the agent"


def test_oracle_says_that_it_is_privileged() -> None:
    assert Oracle.privileged
