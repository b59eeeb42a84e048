"""Parts from outside the package, for `tests/test_extensions.py`: one class of each kind."""

import dataclasses

import numpy as np
import torch
from torch import nn

from avn.acoustics.microphone import Microphone
from avn.agents.actor_critic import ActorCriticAgent
from avn.agents.base import Agent
from avn.agents.planner_agent import PlannerAgent
from avn.core.actions import FORWARD, ROTATE_LEFT, ROTATE_RIGHT
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.modules.occupancy_cnn import OccupancyCnn
from avn.modules.sound_cnn import SoundCnn
from avn.navigation.protocols import Protocol
from avn.rl.algorithm import Algorithm
from avn.rl.rollouts import advantages_and_targets, trunk_outputs
from avn.views.renderer import Renderer
from avn.views.settings import RendererConfig


class DeepSound(SoundCnn):
    """A sound network with more layers behind its answer."""

    def __init__(self, layers: int = 2, **recipe):
        super().__init__(**recipe)
        self.net.layers.extend(nn.Linear(2, 2) for _ in range(layers))


class PatientSight(OccupancyCnn):
    """An occupancy network that is less sure the lower its temperature."""

    def __init__(self, temperature: float = 2.0, **recipe):
        super().__init__(**recipe)
        self.temperature = temperature

    def log_odds(self, pictures):
        return super().log_odds(pictures) / self.temperature


class ForgetfulMapper(OccupancyMapper):
    """Forgets its map after some steps."""

    def __init__(self, size: int = 101, after: int = 20):
        super().__init__(size)
        self.after, self.steps = after, 0

    def observe(self, observation, way):
        self.steps += 1
        if self.steps % self.after == 0:
            self.map.log_odds.zero_()
        super().observe(observation, way)


class LazyPlanner(PlannerAgent):
    """Does nothing but turn for the first steps."""

    def __init__(self, mapper, rest: int = 3, **settings):
        super().__init__(mapper, **settings)
        self.resting = rest

    def reset(self, n, generator, protocol):
        super().reset(n, generator, protocol)
        self.left = self.resting

    def act(self, observation):
        actions = super().act(observation)
        self.left -= 1
        return torch.full_like(actions, ROTATE_LEFT) if self.left >= 0 else actions


class DepthCritic(ActorCriticAgent):
    """An actor-critic that sees depth, with a temperature of its actions."""

    needs = ("visual_embedding", "depth")

    def __init__(self, temperature: float = 1.0, **settings):
        super().__init__(**settings)
        self.temperature = temperature


class Square(Agent):
    """Walks round a square."""

    def __init__(self, side: int = 4, clockwise: bool = True):
        self.side, self.turn = side, ROTATE_RIGHT if clockwise else ROTATE_LEFT

    def reset(self, n, generator, protocol):
        super().reset(n, generator, protocol)
        self.step = 0

    def act(self, observation):
        self.step += 1
        action = self.turn if self.step % (self.side + 1) == 0 else FORWARD
        return torch.full((self.n,), action)


@dataclasses.dataclass(frozen=True)
class NearProtocol(Protocol):
    """Succeeds within some moves of the source."""

    within: int = 3

    def goal_cells(self, grid, sources):
        return grid.distances[sources] <= self.within


@dataclasses.dataclass
class StripesConfig(RendererConfig):
    period: int = 4


class Stripes(Renderer):
    """Pictures of stripes, as bright as the heading."""

    def __init__(self, cfg: StripesConfig, plan, part, appearance_seed=0, prepared=None):
        self.cfg = cfg

    def prepare(self):
        return {"nothing": np.zeros(1)}

    def views(self, centres, headings):
        size = self.cfg.camera.size
        stripes = (np.arange(size) // self.cfg.period % 2 * 100).astype(np.uint8)
        rgb = np.empty((len(headings), size, size, 3), np.uint8)
        light = (20 * headings)[:, None, None, None].astype(np.uint8)
        rgb[:] = stripes[None, None, :, None] + light
        return rgb, np.ones((len(headings), size, size), np.float16)


@dataclasses.dataclass
class Reinforce(Algorithm):
    """Policy gradient of the return (Williams, Machine Learning 8, 1992), less a constant."""

    constant: float = 0.0

    def build_loss(self, network, features):
        def loss(batch):
            joint = trunk_outputs(network, features, batch)
            value = torch.zeros_like(joint[..., :1])
            _, returns = advantages_and_targets(network, features, batch, value, self.gamma, 1.0)
            log_p = network.actor(joint).log_softmax(-1)
            chosen = log_p.gather(-1, batch["action"][..., None])
            earned = returns.detach()
            return -(chosen * (earned - self.constant)).mean(), {"return": float(earned.mean())}

        return loss


class Clipping(Microphone):
    """Cannot record more than so much."""

    def __init__(self, limit: float = 0.1, **base):
        super().__init__(**base)
        self.limit = limit

    def record(self, clips, noise):
        return super().record(clips, noise).clamp_(-self.limit, self.limit)


class PlainModule(nn.Module):
    """A module that is no part of any kind."""

    def forward(self, values):
        return values


class NoActions(Agent):
    """An agent that does not say what it does."""


def make_agent():
    """A function where a class is wanted."""
    return Square()


class SmellCritic(ActorCriticAgent):
    """An actor-critic that wants what nobody has."""

    needs = ("visual_embedding", "smell")


class WaveCritic(ActorCriticAgent):
    """An actor-critic that wants what no table holds."""

    needs = ("visual_embedding", "waveform")
