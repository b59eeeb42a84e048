"""N training episodes in several apartments, as a batch of tensors."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from avn.core.actions import BACKWARD, action_error
from avn.core.clip_id import ClipId
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.navigation.scene_batch import SceneBatch, advance
from avn.navigation.start_sampler import StartSampler

_KEPT = (
    "state",
    "start",
    "source",
    "trajectory_index",
    "sound",
    "realisation",
    "actions",
    "attempted",
    "collided",
    "success",
)


class BatchedEpisodes:
    """N episodes, each with its own apartment, source, sound and start.

    Parameters
    ----------
    tables : SceneBatch
        Apartments and their observations.
    starts : StartSampler
        Draws source, exploration trajectory and start of each episode.
    n : int
        Number of episodes.
    protocol : Protocol
        Actions, goal and limits of an episode.
    max_steps : int or None
        Actions after which an episode is truncated; None for the limits of the protocol.
    reward : RewardConfig, optional
        Reward of each action; the default rewards if None.
    seed : int
        Seed of the episodes and realisations.

    Attributes
    ----------
    state, start, source, sound, realisation : (N,) int64
        Current and first state of each agent, and the indices of its source, sound and realisation.
    trajectory_index : (N,) int64
        Exploration trajectory of each episode, counted over all apartments.
    actions, attempted : (N,) int64
        Actions and attempted moves in the episode.
    collided : (N,) bool
        True if the last action was a blocked move.
    success : (N,) bool
        True if the last action ended the episode with success.
    """

    def __init__(
        self,
        tables: SceneBatch,
        starts: StartSampler,
        n: int,
        protocol: Protocol,
        max_steps: int | None = None,
        reward: RewardConfig | None = None,
        seed: int = 0,
    ) -> None:
        self.tables, self.starts, self.protocol = tables, starts, protocol
        self.max_steps, self.n = max_steps, n
        self.reward = reward or RewardConfig()
        self.generator = torch.Generator().manual_seed(seed)
        self.state, self.start, self.source, self.trajectory_index, self.sound, self.realisation = (
            torch.zeros(n, dtype=torch.int64) for _ in range(6)
        )
        self.actions, self.attempted = (torch.zeros(n, dtype=torch.int64) for _ in range(2))
        self.collided, self.success = (torch.zeros(n, dtype=torch.bool) for _ in range(2))
        self.begin(torch.ones(n, dtype=torch.bool))

    def begin(self, rows: Tensor) -> None:
        """Begin new episodes in some rows.

        Random numbers are drawn for all rows, so that the generator advances alike for any choice.

        Parameters
        ----------
        rows : (N,) bool
            Rows that begin a new episode.
        """
        source, trajectory_index, start = self.starts.draw(self.n, self.generator)
        sound = torch.randint(self.tables.sounds, (self.n,), generator=self.generator)
        trajectory_index = (
            self.tables.source_scene[source] * self.starts.trajectories + trajectory_index
        )
        self.source = torch.where(rows, source, self.source)
        self.trajectory_index = torch.where(rows, trajectory_index, self.trajectory_index)
        self.start = torch.where(rows, start, self.start)
        self.state = torch.where(rows, start, self.state)
        self.sound = torch.where(rows, sound, self.sound)
        self._clear(rows)
        self._draw_realisations(rows)

    def place(
        self,
        rows: Tensor,
        source: Tensor | None = None,
        start: Tensor | None = None,
        sound: Tensor | None = None,
    ) -> None:
        """Set source, start and sound of episodes that have just begun.

        Parameters
        ----------
        rows : (N,) bool
            Rows to change.
        source, start, sound : (N,) int64, optional
            Source, first state and sound of each row; what is None stays as it was drawn. With a
            source and no start, a start away from that source is drawn.
        """
        if source is not None:
            self.source = torch.where(rows, source, self.source)
            if start is None:
                start = self.starts.draw_starts(self.source, self.generator)
            first = self.tables.source_scene[self.source] * self.starts.trajectories
            self.trajectory_index = torch.where(rows, first, self.trajectory_index)
        if start is not None:
            self.start = torch.where(rows, start, self.start)
            self.state = torch.where(rows, start, self.state)
        if sound is not None:
            self.sound = torch.where(rows, sound, self.sound)

    def _clear(self, rows: Tensor) -> None:
        """Set the counts of some rows to those of a new episode."""
        self.actions = self.actions.masked_fill(rows, 0)
        self.attempted = self.attempted.masked_fill(rows, 0)
        self.collided, self.success = self.collided & ~rows, self.success & ~rows

    def step(self, actions: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Move every agent by one action.

        Parameters
        ----------
        actions : (N,) int64
            See `avn.core.actions`.

        Returns
        -------
        reward : (N,) float32
        terminated, truncated : (N,) bool
            Episodes that ended under the protocol, and episodes that a limit cut off.

        Raises
        ------
        ValueError
            If the actions are not an (N,) int64 tensor of actions of the protocol.
        """
        error = action_error(actions, self.n, self.protocol.actions, self.protocol.name)
        if error:
            raise ValueError(error)
        found = advance(self.tables, self.tables.goal_row[self.source], self.state, actions)
        self.state, self.collided, arrived = found
        self.actions = self.actions + 1
        self.attempted = self.attempted + (actions <= BACKWARD)
        self.success, terminated = self.protocol.judge(actions, arrived)
        self._draw_realisations()
        truncated = self._out_of_time() & ~terminated
        reward = torch.where(self.collided, self.reward.collision, self.reward.step)
        return torch.where(self.success, self.reward.success, reward), terminated, truncated

    def clip_id(self) -> ClipId:
        """Return the clip that each agent hears now."""
        return ClipId(self.source, self.state, self.sound, self.realisation)

    def clip(self) -> Tensor:
        """Return the row of the clip that each agent hears now, (N,) int64."""
        return self.tables.clip(self.clip_id())

    def seed(self, seed: int) -> None:
        """Set the seed of the episodes that begin from now on."""
        self.generator.manual_seed(seed)

    def odometry(self) -> Tensor:
        """Return cells right, cells forward and quarter turns since the start, (N, 3) int64."""
        return self.tables.odometry(self.start, self.state)

    def state_dict(self) -> dict[str, Any]:
        """Return copies of all tensors that change, and the state of the generator."""
        kept: dict[str, Any] = {name: getattr(self, name).clone() for name in _KEPT}
        return kept | {"generator": self.generator.get_state()}

    def load_state_dict(self, kept: dict[str, Any]) -> None:
        """Restore what `state_dict` returned."""
        for name in _KEPT:
            if name in kept:  # checkpoints of earlier versions lack `success`
                setattr(self, name, kept[name].clone())
        self.generator.set_state(kept["generator"])

    def _draw_realisations(self, rows: Tensor | None = None) -> None:
        """Draw a new realisation for every agent, or for those of some rows."""
        if self.tables.realisations > 1:
            realisations = torch.randint(
                self.tables.realisations, (self.n,), generator=self.generator
            )
            self.realisation = (
                realisations if rows is None else torch.where(rows, realisations, self.realisation)
            )

    def _out_of_time(self) -> Tensor:
        """Return the episodes whose limit of actions or moves is reached, (N,) bool."""
        if self.max_steps is not None:
            return self.actions >= self.max_steps
        most = self.tables.most_moves[self.tables.goal_row[self.source] + self.start]
        return self.protocol.out_of_time(self.actions, self.attempted, most)
