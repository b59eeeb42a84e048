"""Exploration walks that many training episodes share.

A memory agent explores hundreds of steps before an episode of some twenty. So each apartment has a
few walks, their memories are worked out for all walks at once, and an episode begins with the
memory of one of them. The memories are those of the weights at that time, and are worked out again
after every few gradients.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import torch
from tensordict import TensorDict
from torch import Tensor

from avn.core.actions import HEADINGS
from avn.core.random import derive, scramble
from avn.mapping.ego_map import EgoMap, around, offsets
from avn.mapping.spatial_memory import SpatialMemory, distinct, locate
from avn.navigation.exploration import explore
from avn.navigation.place import Place
from avn.navigation.scene_batch import SceneBatch
from avn.rl.networks import ActorCritic


class ExplorationMemory:
    """Walks of R apartments, W each, in silence.

    Parameters
    ----------
    tables : Tables
        With `visual_embedding`, and `local_patch` for agents that map.
    walks : (R, W, T) int64 tensor
        States, as `tables` counts them.
    map_size, map_width : int, optional
        Of the map that the agents draw meanwhile; 0 for none.
    top : int
        Entries of the spatial memory that tell where an agent is on the map of its walk.

    Attributes
    ----------
    h, c : (R * W, 1, units) float32 tensors
        Memory of a network after each walk; see `remember`.
    """

    def __init__(
        self, tables: SceneBatch, walks: Tensor, map_size: int = 0, map_width: int = 0, top: int = 3
    ) -> None:
        self.tables, self.walks = tables, walks
        self.h = self.c = torch.zeros(walks.shape[0] * walks.shape[1], 1, 0)
        self._flat = walks.flatten(0, 1)
        self.maps = bool(map_size)
        if self.maps:
            self._offsets = offsets(map_width)
            self._draw_maps(map_size, map_width)
            self._poses = self._find_places(top)

    def visited(self) -> Tensor:
        """Which states' cells each walk has visited, (R, W, S) bool."""
        cells = torch.zeros(len(self._flat), self.tables.states // HEADINGS, dtype=torch.bool)
        cells.scatter_(1, self._flat // HEADINGS, True)
        return cells.repeat_interleave(HEADINGS, dim=1).unflatten(0, self.walks.shape[:2])

    def remember(self, network: ActorCritic) -> None:
        """Work through all walks with a network, and keep its memories."""

        def inputs(step: int) -> dict[str, Tensor]:
            own = {"visual_embedding": self.tables.visual["visual_embedding"][self._flat[:, step]]}
            if self.maps:
                own["map"] = with_unknown_walk(self._seen[:, step].float())
            return own

        self.h, self.c = explored(network, inputs, *self._flat.shape)

    def map_of_walk(self, walk: Tensor, state: Tensor) -> Tensor:
        """What episodes remember of their walk's map around them, (N, width, width) float32."""
        return around(self._beliefs, walk, self._poses[walk, self._local(state)], self._offsets)

    def _local(self, state: Tensor) -> Tensor:
        return state - self.tables.first_state[self.tables.room[state]]

    def _odometry(self) -> Tensor:
        """(R * W, T, 3) int64 since the start of each walk."""
        return self.tables.odometry(self._flat[:, :1], self._flat)

    def _draw_maps(self, size: int, width: int) -> None:
        """The map around the agent at each step of the walks, and the maps at their end."""
        ego, seen, odometry = EgoMap(len(self._flat), size, width), [], self._odometry()
        for step in range(self._flat.shape[1]):
            observation = TensorDict(
                {
                    "odometry": odometry[:, step],
                    "collided": torch.zeros(len(self._flat), dtype=torch.bool),
                    "local_patch": self.tables.visual["local_patch"][self._flat[:, step]],
                },
                batch_size=[len(self._flat)],
            )
            seen.append(ego.observe(observation).half())
        self._seen, self._beliefs = torch.stack(seen, dim=1), ego.map.log_odds

    def _find_places(self, top: int) -> Tensor:
        """Where each state is on the map of each walk, by what it looks like; (R * W, S', 3)."""
        features, odometry = self.tables.visual["visual_embedding"], self._odometry()
        bounds, each = self.tables.first_state.tolist(), self.walks.shape[1]
        longest = max(high - low for low, high in itertools.pairwise(bounds))
        poses = torch.zeros(len(self._flat), longest, 3, dtype=torch.int64)
        for index, walk in enumerate(self._flat):
            low, high = bounds[index // each], bounds[index // each + 1]
            keys, values = distinct(features[walk][None], odometry[index][None])
            memory = SpatialMemory(keys, values, torch.zeros(high - low, dtype=torch.int64), top)
            found = locate(*memory.recall(features[low:high], own=False))
            poses[index, : high - low] = found.round().long()
        return poses


def with_unknown_walk(own: Tensor) -> Tensor:
    """The map of an agent that explores: its own, and none of an earlier walk; (N, 2, w, w)."""
    return torch.stack((own, torch.full_like(own, 0.5)), dim=1)


@torch.no_grad()
def explored(
    network: ActorCritic, inputs: Callable[[int], dict[str, Tensor]], walks: int, steps: int
) -> tuple[Tensor, Tensor]:
    """The memory of a network after it has seen W walks of T steps.

    Parameters
    ----------
    inputs : callable
        What is observed at a step of all walks; what is missing, such as sound, is silent.

    Returns
    -------
    h, c : (W, 1, units) float32 tensors
    """
    h, c = network.no_memory(walks)
    for step in range(steps):
        _, h, c = network.remember(network.embed(inputs(step)), h, c)
    return h, c


def draw_walks(
    places: list[Place], tables: SceneBatch, walks: int, steps: int, seed: int
) -> Tensor:
    """Exploration walks of each apartment, (R, walks, steps + 1) int64, as `tables` counts."""
    drawn = []
    for place, first in zip(places, tables.first_state.tolist(), strict=False):
        keys = scramble(np.uint64(derive("training walk", seed, place.name)), np.arange(walks))
        drawn.append(torch.from_numpy(explore(place.grid.neighbours, keys, steps)) + first)
    return torch.stack(drawn)
