"""Small worlds in which it is known what the best agent earns."""

import itertools
from contextlib import nullcontext

import pytest
import torch

from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.navigation.scene_batch import SceneBatch, build_scene_batch
from avn.rl.a3c import A3C
from avn.rl.networks import ActorCritic, NetworkSpec
from avn.rl.shared import SharedState, flatten_parameters
from avn.rl.worker import TrainingSpec, Worker

FLAT = """
aaaaaaaaa
a.aaa.aAa
aaaaaaaaa
aaabbbbbB
"""


@pytest.fixture
def flat() -> DrawnScene:
    return draw("flat", FLAT)


@pytest.fixture
def rules() -> Protocol:
    return Protocol("var", "box", False, "moves", max_moves_ratio=2.0)


def random_tables(scenes, protocol, seed: int = 0, features: int = 8, sound: int = 6) -> SceneBatch:
    """Tables with random features, other ones in every state and for every clip."""
    generator = torch.Generator().manual_seed(seed)
    observed = []
    for scene in scenes:
        states, sources = 4 * len(scene.grid.lattice), len(scene.sources)
        heard = torch.randn(sources, states, 2, 3, sound, generator=generator)
        window = torch.rand(states, 5, 5, generator=generator)
        visual = {
            "visual_embedding": torch.randn(states, features, generator=generator),
            "local_patch": window,
        }
        observed.append(SceneObservations({"audio_embedding": heard}, visual))
    return build_scene_batch(scenes, protocol, observed)


def make_spec(tables: SceneBatch, protocol: Protocol, trajectories=None, **recipe) -> TrainingSpec:
    """A task for a small network; `memory`, `width` and `maps` are of the network."""
    memory, width = recipe.pop("memory", 0), recipe.pop("width", 16)
    maps, inputs = (
        recipe.pop("maps", 0),
        recipe.pop("inputs", ("visual_embedding", "audio_embedding")),
    )
    both = {**tables.visual, **tables.audio}
    features = {name: both[name].shape[-1] for name in inputs}
    network_spec = NetworkSpec(features, protocol.actions, width, memory, maps, map_width=11)
    # all that the tests count on is named here, whatever the defaults become
    given = {
        "num_envs": 6,
        "rollout_length": 5,
        "max_steps": 12,
        "workers": 1,
        "reward": RewardConfig(),
    }
    given |= {
        "entropy_coef": 0.01,
        "value_coef": 0.5,
        "gamma": 0.99,
        "alpha": 0.99,
        "gae_lambda": 1.0,
    }
    recipe = A3C(**(given | recipe))
    torch.manual_seed(0)
    buffers = dict(ActorCritic(network_spec).named_buffers())
    return TrainingSpec(
        tables, protocol, network_spec, recipe, buffers, map_size=41, trajectories=trajectories
    )


def make_worker(spec: TrainingSpec, rank: int = 0, seed: int = 0) -> Worker:
    """A worker with a shared state of its own."""
    torch.manual_seed(seed)
    network = ActorCritic(spec.network_spec)
    network.load_state_dict(spec.buffers, strict=False)
    weights, _ = flatten_parameters(network)
    return Worker(rank, spec, SharedState.of(weights), nullcontext)


def make_trajectories(tables: SceneBatch, trajectories: int = 3, steps: int = 9) -> torch.Tensor:
    """States as walks, which need not hang together."""
    bounds = tables.first_state.tolist()
    generator = torch.Generator().manual_seed(5)
    drawn = [
        torch.randint(low, high, (trajectories, steps), generator=generator)
        for low, high in itertools.pairwise(bounds)
    ]
    return torch.stack(drawn)
