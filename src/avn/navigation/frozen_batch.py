"""Frozen episodes of several apartments, played one after another in a batch of N rows."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.episodes import Episodes
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.navigation.scene_batch import SceneBatch
from avn.navigation.simulator import drawn_realisations
from avn.navigation.start_sampler import build_start_sampler


class FrozenBatch(BatchedEpisodes):
    """N rows that play the frozen episodes of an evaluation in their order.

    A row that begins takes the next episode of the list, the first row first. After the last
    episode the list begins again. Starts, sounds, limits and the realisation of the clip at each
    step are those of `Simulator`.

    Parameters
    ----------
    tables : SceneBatch
        Apartments and their observations.
    episodes : sequence of Episodes
        Episodes of each apartment, in the order of `tables`.
    n : int
        N, number of rows.
    protocol : Protocol
        Actions, goal and limits of an episode.
    reward : RewardConfig, optional
        Reward of each action; the default rewards if None.

    Attributes
    ----------
    episode : (N,) int64
        Number of each row's episode in the list.
    """

    def __init__(
        self,
        tables: SceneBatch,
        episodes: Sequence[Episodes],
        n: int,
        protocol: Protocol,
        reward: RewardConfig | None = None,
    ) -> None:
        first_source = tables.first_source()
        self._source = torch.cat(
            [torch.from_numpy(e.source) + first_source[i] for i, e in enumerate(episodes)]
        )
        self._start = torch.cat(
            [torch.from_numpy(e.start) + tables.first_state[i] for i, e in enumerate(episodes)]
        )
        self._sound = torch.cat([torch.from_numpy(e.sound) for e in episodes])
        draws, count = protocol.max_actions + 1, tables.realisations
        self._realisations = torch.cat([drawn_realisations(e, draws, count) for e in episodes])
        self.episode, self._next = torch.zeros(n, dtype=torch.int64), 0
        super().__init__(tables, build_start_sampler(tables), n, protocol, reward=reward)

    def __len__(self) -> int:
        """Return the number of episodes in the list."""
        return len(self._start)

    def begin(self, rows: Tensor) -> None:
        """Begin the next episodes of the list in some rows, (N,) bool."""
        chosen = rows.nonzero()[:, 0]
        following = (self._next + torch.arange(len(chosen))) % len(self)
        self._next = (self._next + len(chosen)) % len(self)
        self.episode = self.episode.index_put((chosen,), following)
        self.source, self.sound = self._source[self.episode], self._sound[self.episode]
        self.start = self._start[self.episode]
        self.state = torch.where(rows, self.start, self.state)
        self.trajectory_index = self.tables.source_scene[self.source] * self.starts.trajectories
        self._clear(rows)
        self._draw_realisations()

    def seed(self, seed: int) -> None:
        """Begin the list anew; its episodes do not depend on the seed."""
        self._next = 0

    def _draw_realisations(self, rows: Tensor | None = None) -> None:
        step = self.actions.clamp(max=self._realisations.shape[1] - 1)
        self.realisation = self._realisations[self.episode, step].long()
