"""Actor-critic agents: what A3C has trained, acting in the episodes of an evaluation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent
from avn.core.errors import UserError
from avn.mapping.ego_map import WIDTH, EgoMap, around, offsets
from avn.mapping.spatial_memory import SpatialMemory, distinct, locate
from avn.navigation.protocols import Protocol
from avn.rl.exploration_memory import explored, with_unknown_walk
from avn.rl.networks import ActorCritic, first_of


class ActorCriticAgent(Agent):
    """Acts with a trained actor-critic network.

    An agent with a memory explores first, in silence, and begins its episodes with what it
    remembers of that. One that maps sees its map around it, in its heading; if it explored, it sees
    the map of that walk beside it, at the place that the pictures of the walk tell it.

    Parameters
    ----------
    network : ActorCritic or None
        None for an agent that is only asked what it wants.
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
    hears, maps : bool
        Whether it hears, and whether it draws a map.
    map_size : int
        Squares along each side of its maps.
    """

    needs: ClassVar[tuple[str, ...]] = ("visual_embedding",)

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
        heard = ("audio_embedding",) if self.hears else ()
        return (*self.needs, *heard, *(("local_patch",) if self.maps else ()))

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes, of which nothing is remembered."""
        super().reset(n, generator, protocol)
        network = self._trained()
        # The episodes that are worked on, by number, and those of them that go on.
        self._rows, self._awake = torch.arange(n), torch.ones(n, dtype=torch.bool)
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
            own = {"visual_embedding": walks["visual_embedding"][:, step]}
            if ego is not None:
                own["map"] = with_unknown_walk(ego.observe(walks[:, step]))
            return own

        h, c = explored(self._trained(), inputs, count, steps)
        self._h, self._c = h[walk], c[walk]
        if ego is not None:
            keys, values = distinct(walks["visual_embedding"], walks["odometry"])
            memory = SpatialMemory(keys, values, walk, self.top)
            self._walked = OccupancyWalk(memory, ego.map.log_odds, walk, offsets(self.map_width))

    def rest(self, done: Tensor) -> None:
        """Work no more on episodes that are over, as soon as half of them are."""
        self._awake = ~done[self._rows]
        if 2 * int(self._awake.sum()) > len(self._rows):
            return
        kept = self._awake.nonzero()[:, 0]
        self._rows, self._h, self._c = self._rows[kept], self._h[kept], self._c[kept]
        if self._actions is not None:
            self._actions = self._actions[kept]
        if self._map is not None:
            self._map.keep(kept)
        if self._walked is not None:
            self._walked = self._walked.keep(kept)

    def act(self, observation: TensorDict) -> Tensor:
        """One action for every episode."""
        # drawn for all, so that what an episode draws does not depend on who is still there
        race = torch.empty(self.n, self._trained().shape.actions)
        race.exponential_(generator=self.generator)
        actions = torch.zeros(self.n, dtype=torch.int64)
        if len(self._rows):
            everyone = len(self._rows) == self.n
            own = observation if everyone else observation[self._rows]
            actions[self._rows] = self._actions = self._chosen(own, race[self._rows])
        return actions

    @torch.no_grad()
    def _chosen(self, observation: TensorDict, race: Tensor) -> Tensor:
        """Actions of the episodes that are worked on."""
        network = self._trained()
        seen = {name: observation[name] for name in network.shape.features}
        if self._map is not None:
            own = self._map.observe(observation, self._actions)
            channels = [own] if self._walked is None else [own, self._walked.around(seen)]
            seen["map"] = torch.stack(channels, dim=1)
        joint, self._h, self._c = network.remember(network.embed(seen), self._h, self._c)
        logits = network.actor(joint)
        return first_of(logits, race) if self.samples else logits.argmax(dim=-1)

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

    def keep(self, rows: Tensor) -> OccupancyWalk:
        """The same for some of the agents, by number."""
        self.memory.walk = self.memory.walk[rows]
        return replace(self, walk=self.walk[rows])

    def around(self, seen: dict[str, Tensor]) -> Tensor:
        """The map of each agent's walk around it, (N, width, width) float32."""
        pose = locate(*self.memory.recall(seen["visual_embedding"], own=False)).round().long()
        return around(self.log_odds, self.walk, pose, self.squares)
