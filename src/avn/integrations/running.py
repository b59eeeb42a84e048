"""Episodes of an environment with what Gymnasium needs of them: infos and pictures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from avn.core.errors import UserError
from avn.integrations.episode_options import place
from avn.integrations.render import EpisodePictures
from avn.integrations.spaces import Observation, arrays
from avn.integrations.world import MaxSteps, World
from avn.navigation.episode_metrics import episode_metrics
from avn.navigation.frozen_batch import FrozenBatch


class RunningEpisodes:
    """N running episodes of a world.

    Parameters
    ----------
    world : World
        Apartments and observations.
    n : int
        N, number of agents, 1 or more.
    max_steps : int, "algorithm" or None
        See `World.environment`.
    """

    def __init__(self, world: World, n: int, max_steps: MaxSteps) -> None:
        self.world, self.n = world, n
        self.env = world.environment(n, max_steps)
        self.actions = world.protocol.actions
        self._pictures = None
        if world.views is not None:
            self._pictures = EpisodePictures(world.scenes, world.views)
        self._paths: list[list[int]] = [[] for _ in range(n)]

    def begin(self, rows: torch.Tensor, options: Mapping[str, Any] | None = None) -> None:
        """Begin new episodes in some rows, (N,) bool; see `episode_options.place`."""
        self.env.begin(rows)
        if options:
            place(self.env, self.world, rows, options)
        if self._pictures is not None:
            for row in rows.nonzero()[:, 0].tolist():
                self._paths[row] = [int(self.env.episodes.state[row])]

    def move(self, actions: torch.Tensor) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Move the agents; return reward float64, terminated and truncated bool, each (N,)."""
        reward, terminated, truncated = (value.numpy() for value in self.env.move(actions))
        if self._pictures is not None:
            for row, state in enumerate(self.env.episodes.state.tolist()):
                self._paths[row].append(state)
        return reward.astype(np.float64), terminated, truncated

    def observations(self) -> Observation:
        """Return the observations by name, each (N, ...)."""
        return arrays(self.env)

    def infos(self) -> dict[str, NDArray[Any]]:
        """Return the infos of all episodes by name, each (N,)."""
        episodes, tables = self.env.episodes, self.world.tables
        found = {
            name: value.numpy()
            for name, value in episode_metrics(episodes, self.env.collisions).items()
        }
        scenes = np.array([scene.name for scene in self.world.scenes], dtype=object)
        found["scene"] = scenes[tables.source_scene[episodes.source].numpy()]
        found["sound"] = np.array(self.world.sounds, dtype=object)[episodes.sound.numpy()]
        if isinstance(episodes, FrozenBatch):
            found["episode"] = episodes.episode.numpy().copy()
        return found

    def picture(self, row: int) -> NDArray[np.uint8]:
        """Draw the picture of an episode; see `EpisodePictures.frame`."""
        if self._pictures is None:
            raise UserError("render: make the environment with render_mode='rgb_array'")
        source = self.env.episodes.source[row]
        scene = self.world.tables.source_scene[source]
        first_state = int(self.world.tables.first_state[scene])
        path = [state - first_state for state in self._paths[row]]
        if not path:
            raise UserError("render: call reset first")
        return self._pictures.frame(
            int(scene), path, int(source - self.world.tables.first_source()[scene])
        )
