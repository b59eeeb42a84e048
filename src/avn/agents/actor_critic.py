"""Actor-critic agents: networks trained by A3C, acting in evaluation episodes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import torch
from torch import Tensor

from avn.agents.base import Agent
from avn.core.errors import UserError
from avn.mapping.ego_map import WIDTH, EgoMap, around, offsets
from avn.mapping.spatial_memory import SpatialMemory, distinct, locate
from avn.navigation.protocols import Protocol

if TYPE_CHECKING:
    from tensordict import TensorDict

    from avn.rl.networks import ActorCritic


class ActorCriticAgent(Agent):
    """Agent that acts with a trained actor-critic network.

    An agent with an LSTM explores first, without audio, and begins its episodes with the LSTM
    state after the exploration. An agent with a map observes the part of the map around it,
    turned to its heading. If it explored, it also observes the map of the exploration, centred
    on its estimated pose there; a spatial memory of the exploration gives the pose.

    Parameters
    ----------
    network : ActorCritic or None
        Trained network; None if only `wants` is used.
    width : int
        Units of each layer of the trunk, 1 or more.
    memory : int
        Units of the LSTM; 0 for an agent without memory and exploration.
    map_width : int
        Squares along each side of the observed part of the map, odd; used with a mapper.
    top : int
        Entries of the spatial memory that an estimate of the pose averages, 1 or more.
    samples : bool
        True to sample actions from the policy, False to take the most likely action.
    hears, maps : bool
        True if the network has audio features, and a map.
    map_size : int
        Squares along each side of the maps, odd.

    Raises
    ------
    UserError
        If `width`, `top` or `memory` is out of range.
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
        """Return the names of the visual features, audio features and local patches it needs."""
        heard = ("audio_embedding",) if self.hears else ()
        return (*self.needs, *heard, *(("local_patch",) if self.maps else ()))

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes with empty memories. See `Agent.reset`."""
        super().reset(n, generator, protocol)
        network = self._trained()
        # Numbers of the episodes in the batch of the network, and which of them are not over.
        self._rows, self._active = torch.arange(n), torch.ones(n, dtype=torch.bool)
        self._h, self._c = network.no_memory(n)
        self._map = EgoMap(n, self.map_size, self.map_width) if self.maps else None
        self._actions: Tensor | None = None
        self._explored_map: ExploredMap | None = None

    @torch.no_grad()
    def explore(self, trajectories: TensorDict, trajectory_index: Tensor) -> None:
        """Run the network along the trajectories without audio. See `Agent.explore`."""
        from avn.rl.exploration_memory import explore_all, with_unknown_exploration

        count, steps = trajectories.batch_size
        ego = EgoMap(count, self.map_size, self.map_width) if self.maps else None

        def inputs(step: int) -> dict[str, Tensor]:
            features = self._trained().spec.features
            known = set(trajectories.keys())
            own = {name: trajectories[name][:, step] for name in features if name in known}
            if ego is not None:
                own["map"] = with_unknown_exploration(ego.observe(trajectories[:, step]))
            return own

        h, c = explore_all(self._trained(), inputs, count, steps)
        self._h, self._c = h[trajectory_index], c[trajectory_index]
        if ego is not None:
            keys, values = distinct(trajectories["visual_embedding"], trajectories["odometry"])
            memory = SpatialMemory(keys, values, trajectory_index, self.top)
            self._explored_map = ExploredMap(
                memory, ego.map.log_odds, trajectory_index, offsets(self.map_width)
            )

    def set_active(self, active: Tensor) -> None:
        """Drop finished episodes from the batch as soon as half of it is finished."""
        self._active = active[self._rows]
        if 2 * int(self._active.sum()) > len(self._rows):
            return
        kept = self._active.nonzero()[:, 0]
        self._rows, self._h, self._c = self._rows[kept], self._h[kept], self._c[kept]
        if self._actions is not None:
            self._actions = self._actions[kept]
        if self._map is not None:
            self._map.keep(kept)
        if self._explored_map is not None:
            self._explored_map = self._explored_map.keep(kept)

    def act(self, observation: TensorDict) -> Tensor:
        """Choose an action for every episode. See `Agent.act`."""
        # drawn for all, so that the draws of an episode do not depend on which episodes are over
        race = torch.empty(self.n, self._trained().spec.actions)
        race.exponential_(generator=self.generator)
        actions = torch.zeros(self.n, dtype=torch.int64)
        if len(self._rows):
            everyone = len(self._rows) == self.n
            own = observation if everyone else observation[self._rows]
            actions[self._rows] = self._actions = self._chosen(own, race[self._rows])
        return actions

    @torch.no_grad()
    def _chosen(self, observation: TensorDict, race: Tensor) -> Tensor:
        """Choose actions for the episodes in the batch of the network."""
        from avn.rl.networks import first_of

        network = self._trained()
        seen = {name: observation[name] for name in network.spec.features}
        if self._map is not None:
            own = self._map.observe(observation, self._actions)
            channels = (
                [own] if self._explored_map is None else [own, self._explored_map.around(seen)]
            )
            seen["map"] = torch.stack(channels, dim=1)
        joint, self._h, self._c = network.remember(network.embed(seen), self._h, self._c)
        logits = network.actor(joint)
        return first_of(logits, race) if self.samples else logits.argmax(dim=-1)

    def _trained(self) -> ActorCritic:
        if self.network is None:
            raise UserError("baseline: the actor-critic agent has no trained network")
        return self.network


@dataclass(frozen=True)
class ExploredMap:
    """Maps of the exploration, with the spatial memory that localises agents on them.

    Attributes
    ----------
    memory : SpatialMemory
        Visual features and poses of the exploration trajectories.
    log_odds : (W, M, M) float32 tensor
        Maps of the trajectories; see `OccupancyMap`.
    trajectory_index : (N,) int64 tensor
        Trajectory of each agent.
    squares : (4, width**2, 2) int64 tensor
        See `avn.mapping.ego_map.offsets`.
    """

    memory: SpatialMemory
    log_odds: Tensor
    trajectory_index: Tensor
    squares: Tensor

    def keep(self, rows: Tensor) -> ExploredMap:
        """Return the maps of the agents with the given numbers."""
        self.memory.trajectory_index = self.memory.trajectory_index[rows]
        return replace(self, trajectory_index=self.trajectory_index[rows])

    def around(self, seen: dict[str, Tensor]) -> Tensor:
        """Return the part of the map around each agent, (N, width, width) float32."""
        pose = locate(*self.memory.recall(seen["visual_embedding"], own=False)).round().long()
        return around(self.log_odds, self.trajectory_index, pose, self.squares)
