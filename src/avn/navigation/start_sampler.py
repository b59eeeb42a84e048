"""Random starts of training episodes, uniform over the allowed states."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avn.core.errors import UserError
from avn.navigation.scene_batch import SceneBatch


@dataclass(frozen=True)
class StartSampler:
    """Allowed first states of episodes, a list for each source and exploration trajectory.

    Attributes
    ----------
    trajectories : int
        Number of exploration trajectories of each apartment; 1 without exploration.
    states : (...,) int64
        Concatenated lists.
    first, count : (Q * trajectories,) int64
        First index and length of each list.
    """

    trajectories: int
    states: Tensor
    first: Tensor
    count: Tensor

    def draw(self, n: int, generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Draw source, exploration trajectory and start of N episodes, each uniformly.

        Parameters
        ----------
        n : int
            Number of episodes.
        generator : torch.Generator
            Source of the random numbers.

        Returns
        -------
        source, trajectory_index, start : (N,) int64
            The trajectory is counted within the apartment of the source.
        """
        source = torch.randint(len(self.first) // self.trajectories, (n,), generator=generator)
        trajectory_index = torch.randint(self.trajectories, (n,), generator=generator)
        which = source * self.trajectories + trajectory_index
        return source, trajectory_index, self._draw_from(which, generator)

    def draw_starts(self, source: Tensor, generator: torch.Generator) -> Tensor:
        """Draw a start for each of N sources, (N,) int64, without exploration trajectories."""
        return self._draw_from(source * self.trajectories, generator)

    def _draw_from(self, which: Tensor, generator: torch.Generator) -> Tensor:
        index = (torch.rand(len(which), generator=generator) * self.count[which]).long()
        return self.states[self.first[which] + index]


def build_start_sampler(tables: SceneBatch, visited: Tensor | None = None) -> StartSampler:
    """Collect the allowed starts of each source and exploration trajectory.

    Parameters
    ----------
    tables : SceneBatch
        Apartments.
    visited : (R, W, S) bool tensor, optional
        States whose cells each exploration trajectory has visited. Starts exclude them, unless
        no other state is left.

    Returns
    -------
    StartSampler

    Raises
    ------
    UserError
        If a source has no start.
    """
    trajectories = 1 if visited is None else visited.shape[1]
    lists = []
    for source, scene in enumerate(tables.source_scene.tolist()):
        low, high = tables.first_state[scene : scene + 2].tolist()
        states = torch.arange(low, high)
        away = ~tables.goal[tables.goal_row[source] + states]
        if not bool(away.any()):
            raise UserError("split: an apartment is so small that every cell is at the goal")
        for trajectory_index in range(trajectories):
            fresh = away if visited is None else away & ~visited[scene, trajectory_index, low:high]
            lists.append(states[fresh if bool(fresh.any()) else away])
    count = torch.tensor([len(own) for own in lists])
    return StartSampler(trajectories, torch.cat(lists), torch.cumsum(count, 0) - count, count)
