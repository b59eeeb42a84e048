"""Actor-critic agents with untrained networks: what they are shown, and that rows stay apart."""

import numpy as np
import pytest
import torch

from avn.agents.actor_critic import ActorCriticAgent
from avn.agents.rollout import Labels, rollout, rollout_scene
from avn.core.errors import UserError
from avn.navigation.episodes import frozen_episodes
from avn.navigation.navigation_scene import draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator
from avn.rl.networks import ActorCritic, NetworkSpec

FLAT = """
aaaaaaaaaa
a.aaa.aaAa
aaaaaaaaaa
aaa.bbbbbb
Aaa.bbbBbb
"""
RULES = Protocol(
    "var", "box", False, "moves", max_moves_ratio=2.0, num_starts=6, exploration_steps=30
)


def make_agent(memory=0, maps=False, hears=True, **options) -> ActorCriticAgent:
    features = {"visual_embedding": 8} | ({"audio_embedding": 6} if hears else {})
    torch.manual_seed(0)
    shape = NetworkSpec(features, 4, 16, memory, maps * (2 if memory else 1), map_width=11)
    network = ActorCritic(shape)
    with torch.no_grad():
        network.actor.weight.mul_(300)  # far from uniform, so that what it sees counts
    given = {"memory": memory, "map_width": 11, "hears": hears, "maps": maps, "map_size": 41}
    return ActorCriticAgent(network, **(given | options))


def senses(scene):
    generator = torch.Generator().manual_seed(0)
    states, sources = 4 * len(scene.grid.lattice), len(scene.sources)
    feature = torch.nn.functional.normalize(torch.randn(states, 8, generator=generator), dim=1)
    window = torch.rand(states, 5, 5, generator=generator)
    heard = torch.randn(sources, states, 2, 3, 6, generator=generator)
    return SceneObservations(
        {"audio_embedding": heard}, {"visual_embedding": feature, "local_patch": window}
    )


def records(agent, sounds=("one", "two"), rows=None):
    scene = draw("flat", FLAT)
    episodes = frozen_episodes(scene, sounds, RULES, seed=0)
    return rollout_scene(agent, scene, episodes, RULES, Labels("a3c", "resonance"), senses(scene))


@pytest.mark.parametrize("memory", [0, 5])
@pytest.mark.parametrize("maps", [False, True])
def test_what_it_does_does_not_depend_on_which_episodes_are_over(memory, maps, monkeypatch):
    agent = make_agent(memory, maps)
    short = records(agent)
    monkeypatch.setattr(ActorCriticAgent, "set_active", lambda self, active: None)
    whole = records(agent)
    assert short.equals(whole)
    assert short["actions"].nunique() > 3  # episodes did end at different times


def test_the_same_seed_walks_the_same_way_and_the_likeliest_action_is_no_draw():
    assert records(make_agent(5, True)).equals(records(make_agent(5, True)))
    sure = make_agent(samples=False)
    first = records(sure)
    assert not first.equals(records(make_agent()))


def test_it_wants_what_its_network_takes():
    assert make_agent(hears=False).wants(RULES) == ("visual_embedding",)
    assert make_agent(maps=True).wants(RULES) == (
        "visual_embedding",
        "audio_embedding",
        "local_patch",
    )
    assert make_agent(memory=4).explores
    assert not make_agent().explores


def test_an_agent_with_memory_begins_with_what_its_walk_left_it():
    scene = draw("flat", FLAT)
    observed = senses(scene)
    episodes = frozen_episodes(scene, ("one", "two"), RULES, seed=0)
    agent = make_agent(memory=5)
    begun = []

    class Watching(ActorCriticAgent):
        def act(self, observation):
            if not begun:
                begun.append(self._h.clone())
            return super().act(observation)

    agent.__class__ = Watching
    rollout(agent, Simulator(scene, episodes, RULES, observed))
    h, c = agent.network.no_memory(1)
    with torch.no_grad():
        for state in episodes.trajectories[0]:
            seen = {"visual_embedding": observed.visual["visual_embedding"][int(state)][None]}
            _, h, c = agent.network.remember(agent.network.embed(seen), h, c)
    assert torch.allclose(begun[0], h.expand_as(begun[0]), atol=1e-5)
    assert np.all(episodes.trajectory_index == 0)


def test_without_a_network_it_cannot_act():
    with pytest.raises(UserError, match="no trained network"):
        records(ActorCriticAgent())
