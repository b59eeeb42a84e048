"""Where training episodes begin: drawn among all states that a source and a walk allow."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avn.core.errors import UserError
from avn.navigation.scene_batch import SceneBatch


@dataclass(frozen=True)
class StartSampler:
    """For each source and walk, the states in which an episode may begin.

    Attributes
    ----------
    walks : int
        Exploration walks of each apartment; 1 where nothing is explored.
    states : (...,) int64
        All lists, one after another.
    first, count : (Q * walks,) int64
        Where each list begins, and how long it is.
    """

    walks: int
    states: Tensor
    first: Tensor
    count: Tensor

    def draw(self, n: int, generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Source, walk of the source's apartment and start of N episodes, (N,) int64 each.

        A source is drawn, then a walk, then a start, each uniformly.
        """
        source = torch.randint(len(self.first) // self.walks, (n,), generator=generator)
        walk = torch.randint(self.walks, (n,), generator=generator)
        which = source * self.walks + walk
        place = (torch.rand(n, generator=generator) * self.count[which]).long()
        return source, walk, self.states[self.first[which] + place]


def build_start_sampler(tables: SceneBatch, visited: Tensor | None = None) -> StartSampler:
    """The lists of an apartment's tables.

    Parameters
    ----------
    tables : Tables
    visited : (R, walks, S) bool tensor, optional
        States whose cells an exploration walk of each apartment has visited; a start is elsewhere,
        where the walk leaves any.

    Raises
    ------
    UserError
        Where a source has no start.
    """
    walks = 1 if visited is None else visited.shape[1]
    lists = []
    for source, room in enumerate(tables.source_room.tolist()):
        low, high = tables.first_state[room : room + 2].tolist()
        states = torch.arange(low, high)
        away = ~tables.goal[tables.goal_row[source] + states]
        if not bool(away.any()):
            raise UserError("split: an apartment is so small that every cell is at the goal")
        for walk in range(walks):
            fresh = away if visited is None else away & ~visited[room, walk, low:high]
            lists.append(states[fresh if bool(fresh.any()) else away])
    count = torch.tensor([len(own) for own in lists])
    return StartSampler(walks, torch.cat(lists), torch.cumsum(count, 0) - count, count)
