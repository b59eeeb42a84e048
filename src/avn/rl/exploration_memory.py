"""Exploration trajectories that many training episodes share.

An agent with memory explores hundreds of steps before an episode of some twenty. Each apartment
therefore has a few trajectories, their LSTM states are computed in one batch, and an episode begins
with one of them. The states are computed again after every `memory_refresh_interval` batches.
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
from avn.navigation.navigation_scene import NavigationScene
from avn.navigation.scene_batch import SceneBatch
from avn.rl.networks import ActorCritic


class ExplorationMemory:
    """LSTM states and maps after W exploration trajectories in each of R apartments.

    Parameters
    ----------
    tables : SceneBatch
        Holds `visual_embedding`, and `local_patch` for agents with a map.
    trajectories : (R, W, T) int64 tensor
        States, numbered as in `tables`.
    map_size, map_width : int
        Squares along each side of the maps and of their observed part; 0 for no maps.
    top : int
        Entries of the spatial memory that an estimate of the pose averages.

    Attributes
    ----------
    h, c : (R * W, 1, units) float32 tensors
        LSTM state of a network after each trajectory; see `remember`.
    """

    def __init__(
        self,
        tables: SceneBatch,
        trajectories: Tensor,
        map_size: int = 0,
        map_width: int = 0,
        top: int = 3,
    ) -> None:
        self.tables, self.trajectories = tables, trajectories
        self.h = self.c = torch.zeros(trajectories.shape[0] * trajectories.shape[1], 1, 0)
        self._flat = trajectories.flatten(0, 1)
        self.maps = bool(map_size)
        if self.maps:
            self._offsets = offsets(map_width)
            self._draw_maps(map_size, map_width)
            self._poses = self._find_places(top)

    def visited(self) -> Tensor:
        """Return True for states whose cell a trajectory has visited, (R, W, S) bool."""
        cells = torch.zeros(len(self._flat), self.tables.states // HEADINGS, dtype=torch.bool)
        cells.scatter_(1, self._flat // HEADINGS, True)
        return cells.repeat_interleave(HEADINGS, dim=1).unflatten(0, self.trajectories.shape[:2])

    def remember(self, network: ActorCritic) -> None:
        """Compute the LSTM states of a network after all trajectories."""

        def inputs(step: int) -> dict[str, Tensor]:
            states, visual = self._flat[:, step], self.tables.visual
            own = {name: visual[name][states] for name in network.spec.features if name in visual}
            if self.maps:
                own["map"] = with_unknown_exploration(self._seen[:, step].float())
            return own

        self.h, self.c = explore_all(network, inputs, *self._flat.shape)

    def explored_map(self, trajectory_index: Tensor, state: Tensor) -> Tensor:
        """Return the part of the explored map around each agent.

        Parameters
        ----------
        trajectory_index, state : (N,) int64 tensors
            Trajectory and state of each agent, counted over all apartments.

        Returns
        -------
        (N, width, width) float32 tensor
            Probability that each square is free.
        """
        return around(
            self._beliefs,
            trajectory_index,
            self._poses[trajectory_index, self._local(state)],
            self._offsets,
        )

    def _local(self, state: Tensor) -> Tensor:
        return state - self.tables.first_state[self.tables.scene[state]]

    def _odometry(self) -> Tensor:
        """Return the odometry of each trajectory, (R * W, T, 3) int64."""
        return self.tables.odometry(self._flat[:, :1], self._flat)

    def _draw_maps(self, size: int, width: int) -> None:
        """Compute the map around the agent at each step of the trajectories, and the last maps."""
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
        """Estimate the pose of each state on the map of each trajectory, (R * W, S', 3)."""
        features, odometry = self.tables.visual["visual_embedding"], self._odometry()
        bounds, each = self.tables.first_state.tolist(), self.trajectories.shape[1]
        longest = max(high - low for low, high in itertools.pairwise(bounds))
        poses = torch.zeros(len(self._flat), longest, 3, dtype=torch.int64)
        for index, trajectory in enumerate(self._flat):
            low, high = bounds[index // each], bounds[index // each + 1]
            keys, values = distinct(features[trajectory][None], odometry[index][None])
            memory = SpatialMemory(keys, values, torch.zeros(high - low, dtype=torch.int64), top)
            found = locate(*memory.recall(features[low:high], own=False))
            poses[index, : high - low] = found.round().long()
        return poses


def with_unknown_exploration(own: Tensor) -> Tensor:
    """Stack maps (N, w, w) with an unknown explored map, (N, 2, w, w)."""
    return torch.stack((own, torch.full_like(own, 0.5)), dim=1)


@torch.no_grad()
def explore_all(
    network: ActorCritic, inputs: Callable[[int], dict[str, Tensor]], trajectories: int, steps: int
) -> tuple[Tensor, Tensor]:
    """Compute the LSTM state of a network after W trajectories of T steps.

    Parameters
    ----------
    network : ActorCritic
        Network with an LSTM.
    inputs : callable
        Returns the observations of all trajectories at a step; missing ones, such as audio,
        contribute nothing.
    trajectories, steps : int
        W and T.

    Returns
    -------
    h, c : (W, 1, units) float32 tensors
    """
    h, c = network.no_memory(trajectories)
    for step in range(steps):
        _, h, c = network.remember(network.embed(inputs(step)), h, c)
    return h, c


def draw_trajectories(
    scenes: list[NavigationScene], tables: SceneBatch, trajectories: int, steps: int, seed: int
) -> Tensor:
    """Draw exploration trajectories in each apartment.

    Parameters
    ----------
    scenes : list of NavigationScene
        Apartments of `tables`.
    tables : SceneBatch
        Numbers the states.
    trajectories, steps : int
        Trajectories of each apartment, and actions of each.
    seed : int
        Seed of the trajectories.

    Returns
    -------
    (R, trajectories, steps + 1) int64 tensor
        States, numbered as in `tables`.
    """
    drawn = []
    for scene, first in zip(scenes, tables.first_state.tolist(), strict=False):
        keys = scramble(
            np.uint64(derive("training walk", seed, scene.name)), np.arange(trajectories)
        )
        drawn.append(torch.from_numpy(explore(scene.grid.neighbours, keys, steps)) + first)
    return torch.stack(drawn)
