import pytest
import torch
from tensordict import TensorDict

from avn.agents.random_walk import RandomWalk
from avn.agents.rollout import Labels, rollout_scene
from avn.navigation.episodes import exhaustive_episodes
from avn.navigation.navigation_scene import DrawnScene
from avn.navigation.protocols import Protocol

NOTHING = TensorDict({}, batch_size=[10_000])


def test_all_actions_come_with_the_same_chance(protocol: Protocol) -> None:
    agent = RandomWalk()
    agent.reset(10_000, torch.Generator().manual_seed(0), protocol)
    shares = torch.bincount(agent.act(NOTHING), minlength=protocol.actions) / 10_000
    assert len(shares) == (5 if protocol.requires_stop else 4)
    assert torch.allclose(shares, torch.full_like(shares, 1 / len(shares)), atol=0.015)


def test_same_seed_same_actions(protocol: Protocol) -> None:
    agent, draws = RandomWalk(), []
    for seed in (0, 0, 1):
        agent.reset(10_000, torch.Generator().manual_seed(seed), protocol)
        draws.append(agent.act(NOTHING))
    assert (draws[0] == draws[1]).all()
    assert (draws[0] != draws[2]).any()


def test_half_of_the_draws_are_moves(flat: DrawnScene, protocol: Protocol) -> None:
    episodes = exhaustive_episodes(flat, ["ring"], protocol, seed=0)
    frame = rollout_scene(
        RandomWalk(), flat, episodes, protocol, Labels("random_walk", "resonance")
    )
    assert not RandomWalk.privileged
    assert 0.0 < frame["success"].mean() < 0.3
    if protocol.name == "var":
        assert frame["path_length"].sum() / frame["actions"].sum() == pytest.approx(0.5, abs=0.02)
    else:
        # Stop comes with a chance of 1 in 5, so that an episode takes five actions; the cap on
        # moves shortens it under `var_stop`.
        most = 5.0 if protocol.name == "stop" else 4.9
        assert frame["actions"].mean() == pytest.approx(most, abs=0.5)
