"""Actor-critic agents: what A3C has trained, acting in the episodes of an evaluation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent, BaselineConfig
from avn.errors import UserError
from avn.mapping.ego_map import WIDTH, EgoMap, around, offsets
from avn.mapping.spatial_memory import SpatialMemory, distinct, locate
from avn.navigation.protocols import Protocol
from avn.rl.explorations import explored, with_unknown_walk
from avn.rl.networks import ActorCritic, sample


@dataclass
class ActorCriticConfig(BaselineConfig):
    """Schema of `baseline=a3c`.

    Attributes
    ----------
    width : int
        Units of each layer of the trunk.
    memory : int
        Units of the LSTM; 0 for an agent that remembers nothing and does not explore.
    map_width : int
        Squares along each side of the part of the map that it sees, where there is a mapper.
    top : int
        Entries of the spatial memory that tell where it is on the map of its walk.
    samples : bool
        Whether it draws its actions, or takes the likeliest.
    """

    width: int = 128
    memory: int = 0
    map_width: int = WIDTH
    top: int = 3
    samples: bool = True


class ActorCriticAgent(Agent):
    """Acts with a trained actor-critic network.

    An agent with a memory explores first, in silence, and begins its episodes with what it
    remembers of that. One that maps sees its map around it, in its heading; if it explored, it sees
    the map of that walk beside it, at the place that the pictures of the walk tell it.

    Parameters
    ----------
    network : ActorCritic or None
        None for an agent that is only asked what it wants.
    memory, map_width, top, samples
        See `ActorCriticConfig`.
    hears, maps : bool
        Whether it hears, and whether it draws a map.
    map_size : int
        Squares along each side of its maps.
    """

    needs: ClassVar[tuple[str, ...]] = ("feature",)

    def __init__(
        self,
        network: ActorCritic | None = None,
        width: int = 128,
        memory: int = 0,
        map_width: int = WIDTH,
        top: int = 3,
        samples: bool = True,
        hears: bool = False,
        maps: bool = False,
        map_size: int = 101,
    ) -> None:
        if width < 1 or memory < 0 or top < 1:
            raise UserError("baseline: width and top are 1 or more, memory 0 or more")
        self.network, self.samples, self.top = network, samples, top
        self.hears, self.maps, self.map_size = hears, maps, map_size
        self.map_width, self.explores = map_width, memory > 0

    def wants(self, protocol: Protocol) -> tuple[str, ...]:
        """Features of what it sees, of what it hears, and windows for its map."""
        heard = ("sound_feature",) if self.hears else ()
        return (*self.needs, *heard, *(("window",) if self.maps else ()))

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes, of which nothing is remembered."""
        super().reset(n, generator, protocol)
        network = self._trained()
        self._h, self._c = network.no_memory(n)
        self._map = EgoMap(n, self.map_size, self.map_width) if self.maps else None
        self._actions: Tensor | None = None
        self._walked: OccupancyWalk | None = None

    @torch.no_grad()
    def explore(self, walks: TensorDict, walk: Tensor) -> None:
        """Work through the walks in silence, and keep memory and map."""
        count, steps = walks.batch_size
        ego = EgoMap(count, self.map_size, self.map_width) if self.maps else None

        def inputs(step: int) -> dict[str, Tensor]:
            own = {"feature": walks["feature"][:, step]}
            if ego is not None:
                own["map"] = with_unknown_walk(ego.observe(walks[:, step]))
            return own

        h, c = explored(self._trained(), inputs, count, steps)
        self._h, self._c = h[walk], c[walk]
        if ego is not None:
            keys, values = distinct(walks["feature"], walks["odometry"])
            memory = SpatialMemory(keys, values, walk, self.top)
            self._walked = OccupancyWalk(memory, ego.map.log_odds, walk, offsets(self.map_width))

    @torch.no_grad()
    def act(self, observation: TensorDict) -> Tensor:
        """One action for every episode."""
        network = self._trained()
        seen = {name: observation[name] for name in network.shape.features}
        if self._map is not None:
            own = self._map.observe(observation, self._actions)
            channels = [own] if self._walked is None else [own, self._walked.around(seen)]
            seen["map"] = torch.stack(channels, dim=1)
        joint, self._h, self._c = network.remember(network.embed(seen), self._h, self._c)
        logits = network.actor(joint)
        self._actions = sample(logits, self.generator) if self.samples else logits.argmax(dim=-1)
        return self._actions

    def _trained(self) -> ActorCritic:
        if self.network is None:
            raise UserError("baseline: the actor-critic agent has no trained network")
        return self.network


@dataclass(frozen=True)
class OccupancyWalk:
    """Maps of exploration walks, and the pictures that tell where an agent is on them."""

    memory: SpatialMemory
    log_odds: Tensor
    walk: Tensor
    squares: Tensor

    def around(self, seen: dict[str, Tensor]) -> Tensor:
        """The map of each agent's walk around it, (N, width, width) float32."""
        pose = locate(*self.memory.recall(seen["feature"], own=False)).round().long()
        return around(self.log_odds, self.walk, pose, self.squares)
