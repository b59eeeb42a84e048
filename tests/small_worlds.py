"""Small worlds in which it is known what the best agent earns."""

import itertools
from contextlib import nullcontext

import pytest
import torch

from avn.navigation.observations import SceneObservations
from avn.navigation.place import DrawnPlace, draw
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.navigation.tables import Tables, build_tables
from avn.rl.config import A3CConfig
from avn.rl.networks import ActorCritic, Shape
from avn.rl.shared import SharedState, flatten_parameters
from avn.rl.worker import Task, Worker

FLAT = """
aaaaaaaaa
a.aaa.aAa
aaaaaaaaa
aaabbbbbB
"""


@pytest.fixture
def flat() -> DrawnPlace:
    return draw("flat", FLAT)


@pytest.fixture
def rules() -> Protocol:
    return Protocol("var", "box", False, "attempted", moves_factor=2.0)


def random_tables(places, protocol, seed: int = 0, features: int = 8, sound: int = 6) -> Tables:
    """Tables with random features, other ones in every state and for every clip."""
    generator = torch.Generator().manual_seed(seed)
    observed = []
    for place in places:
        states, sources = 4 * len(place.grid.lattice), len(place.sources)
        heard = torch.randn(sources, states, 2, 3, sound, generator=generator)
        window = torch.rand(states, 5, 5, generator=generator)
        visual = {"feature": torch.randn(states, features, generator=generator), "window": window}
        observed.append(SceneObservations({"sound_feature": heard}, visual))
    return build_tables(places, protocol, observed)


def make_task(tables: Tables, protocol: Protocol, walks=None, **recipe) -> Task:
    """A task for a small network; `memory`, `width` and `maps` are of the network."""
    memory, width = recipe.pop("memory", 0), recipe.pop("width", 16)
    maps, inputs = recipe.pop("maps", 0), recipe.pop("inputs", ("feature", "sound_feature"))
    both = {**tables.visual, **tables.audio}
    features = {name: both[name].shape[-1] for name in inputs}
    shape = Shape(features, protocol.actions, width, memory, maps, map_width=11)
    # all that the tests count on is named here, whatever the defaults become
    given = {"episodes": 6, "steps": 5, "max_steps": 12, "workers": 1, "reward": RewardConfig()}
    given |= {"entropy": 0.01, "value": 0.5, "gamma": 0.99, "alpha": 0.99, "gae_lambda": 1.0}
    recipe = A3CConfig(**(given | recipe))
    torch.manual_seed(0)
    buffers = dict(ActorCritic(shape).named_buffers())
    return Task(tables, protocol, shape, recipe, buffers, map_size=41, walks=walks)


def make_worker(task: Task, rank: int = 0, seed: int = 0) -> Worker:
    """A worker with a shared state of its own."""
    torch.manual_seed(seed)
    network = ActorCritic(task.shape)
    network.load_state_dict(task.buffers, strict=False)
    weights, _ = flatten_parameters(network)
    return Worker(rank, task, SharedState.of(weights), nullcontext)


def make_walks(tables: Tables, walks: int = 3, steps: int = 9) -> torch.Tensor:
    """States as walks, which need not hang together."""
    bounds = tables.first_state.tolist()
    generator = torch.Generator().manual_seed(5)
    drawn = [
        torch.randint(low, high, (walks, steps), generator=generator)
        for low, high in itertools.pairwise(bounds)
    ]
    return torch.stack(drawn)
