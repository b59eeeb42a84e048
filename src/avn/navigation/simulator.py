"""Simulator of N episodes in one apartment, stepped as a batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from avn.core.actions import ACTIONS, BACKWARD, HEADINGS, STOP, action_error
from avn.core.clip_id import ClipId
from avn.core.random import scramble
from avn.navigation.distances import Distances, measure
from avn.navigation.dynamics import Course, Dynamics
from avn.navigation.episodes import Episodes
from avn.navigation.navigation_scene import NavigationScene
from avn.navigation.observations import SceneObservations
from avn.navigation.odometry_noise import reckoned
from avn.navigation.protocols import Protocol
from avn.navigation.scene_batch import advance, build_scene_batch

if TYPE_CHECKING:
    from tensordict import TensorDict

# Episodes whose realisations are drawn at once, so that the 64-bit draws stay in the cache.
_CHUNK = 256


class Simulator:
    """Batch of N episodes of one scene.

    Parameters
    ----------
    scene : NavigationScene
        Grid, source cells and lines of sight.
    episodes : Episodes
        Sound, source and start of each episode.
    protocol : Protocol
        Actions, goal and limits of an episode.
    observations : SceneObservations, optional
        Audio and visual observations of the scene. The realisation of a clip at a step is a
        function of the seed, the episode and the number of actions, for every agent.
    dynamics : Dynamics, optional
        What changes in the course of an episode; nothing by default.

    Attributes
    ----------
    state, source, sound : (N,) int64
        State of each agent, and its source and sound; for privileged agents and records only.
    attempted, moves, collisions, slips, actions : (N,) int64
        Attempted moves, moves made, blocked moves, moves that slipped, and all actions including
        Stop.
    course : Course
        What changes in the course of each episode.
    max_attempts : (N,) int64
        Attempted moves that end the episode.
    success, stopped, done : (N,) bool
        Episodes that succeeded, that ended with Stop, and that are over.

    Raises
    ------
    ValueError
        If an observation has another shape than the scene.
    UserError
        If the apartment has no place for a distractor, or the episodes no sound for it.
    """

    def __init__(
        self,
        scene: NavigationScene,
        episodes: Episodes,
        protocol: Protocol,
        observations: SceneObservations | None = None,
        dynamics: Dynamics | None = None,
    ) -> None:
        self.scene = scene
        self.episodes = episodes
        self.protocol = protocol
        self.distances: Distances = measure(scene, protocol)
        self.source = torch.from_numpy(episodes.source)
        self.sound = torch.from_numpy(episodes.sound)
        self.start = torch.from_numpy(episodes.start)
        observed = observations or SceneObservations()
        sounds = len(episodes.sounds)
        if observed.sounds not in (None, sounds):
            raise ValueError(f"clips of {observed.sounds} sounds, but episodes of {sounds}")
        self.tables = build_scene_batch([scene], protocol, [observed], sounds)
        self.course = Course(dynamics or Dynamics(), episodes, scene, protocol.max_actions)
        self._everywhere: Distances | None = None
        if self.course.walk is not None:
            self._everywhere = measure(scene, protocol, np.arange(scene.grid.cells, dtype=np.int32))
            self._goal = torch.from_numpy(self._everywhere.goal)
        self._goal_row = self.tables.goal_row[self.source]
        self._origin = self.tables.origin(self.start)
        self.max_attempts = self.tables.most_moves[self._goal_row + self.start]
        self._realisations = self._drawn()
        self.reset()

    def __len__(self) -> int:
        """Return N."""
        return len(self.start)

    @property
    def walked(self) -> Tensor:
        """Number of actions during which a moving source may have moved, (N,) int64.

        It does not move during Stop, which is judged by what the agent has heard.
        """
        return self.actions - self.stopped.long()

    def to_source(self) -> tuple[Distances, Tensor]:
        """Return the distances to where the sources are now, and the row of each agent's."""
        if self._everywhere is None:
            return self.distances, self.source
        return self._everywhere, self.course.cells(torch.arange(len(self)), self.walked)

    @property
    def moves(self) -> Tensor:
        """Number of moves made, (N,) int64."""
        return self.attempted - self.collisions - self.slips

    def reset(self) -> TensorDict:
        """Put every agent back to its start, and return the first observation."""
        count = len(self)
        self.state = self.start.clone()
        self.attempted, self.collisions, self.slips, self.actions = (
            torch.zeros(count, dtype=torch.int64) for _ in range(4)
        )
        self._reckoned = torch.zeros(count, 3, dtype=torch.int64)
        self.success, self.stopped, self.done, self._collided = (
            torch.zeros(count, dtype=torch.bool) for _ in range(4)
        )
        return self.observe()

    def step(self, actions: Tensor) -> TensorDict:
        """Move every agent whose episode is not over by one action.

        Parameters
        ----------
        actions : (N,) int64
            0 forward, 1 backward, 2 rotate left, 3 rotate right, 4 Stop if the protocol has
            it. Actions of finished episodes have no effect.

        Returns
        -------
        TensorDict
            See `observe`.

        Raises
        ------
        ValueError
            If an action is none of the protocol's, or `actions` has another shape or type.
        """
        self._check(actions)
        running = ~self.done
        slips, twice = self.course.carried_out(actions, self.actions)
        # without effect, as Stop
        effective = torch.where(slips, STOP, actions)
        reached, blocked, arrived = advance(self.tables, self._goal_row, self.state, effective)
        if self.course.walk is not None:
            walked = self.actions + (running & (actions != STOP))
            cells = self.course.cells(torch.arange(len(self)), walked)
            arrived = self._goal[cells, reached // HEADINGS]
        again = self.tables.following[reached * ACTIONS + actions]
        self.state = torch.where(running, torch.where(twice, again, reached), self.state)
        self._reckoned = torch.where(
            running[:, None], reckoned(self._reckoned, actions, blocked), self._reckoned
        )
        moves = (actions <= BACKWARD) & running
        self.attempted += moves
        self.slips += slips & moves
        self.collisions += blocked & running
        self.actions += running
        self._collided = torch.where(running, blocked, self._collided)
        success, over = self.protocol.judge(actions, arrived)
        self.success |= success & running
        if self.protocol.requires_stop:
            self.stopped |= over & running
        self.done |= over & running
        self.done |= self.protocol.out_of_time(self.actions, self.attempted, self.max_attempts)
        return self.observe()

    def observe(self) -> TensorDict:
        """Return the current observations of all agents.

        Returns
        -------
        TensorDict of batch size N
            `collided` (N,) bool, True if the last action was a blocked move; `odometry` (N, 3)
            int64, cells to the right, cells to the front and quarter turns clockwise since the
            start, in the frame of the start; and the audio and visual observations by name.
            Audio that is rendered when it is heard is 0 in finished episodes.
        """
        from tensordict import TensorDict

        odometry = self.odometry()
        observation = {"collided": self._collided.clone(), "odometry": odometry}
        if self.tables.audio or self.tables.rendered:
            heard = self.clip()
            row = self.tables.clip(heard)
            observation |= {name: table[row] for name, table in self.tables.audio.items()}
            mix = self.course.mix(self.actions)
            observation |= self.tables.render(heard, ~self.done, mix)
        observation |= {name: seen[self.state] for name, seen in self.tables.visual.items()}
        return TensorDict(observation, batch_size=[len(self)])

    def odometry(self) -> Tensor:
        """Return the pose of each agent relative to its start, as it counts it, (N, 3) int64."""
        if self.course.dynamics.odometry:
            return self._reckoned.clone()
        return self.tables.odometry(self.start, self.state, self._origin)

    def drift(self) -> Tensor:
        """Return the distance between each agent and where its odometry places it, cells, (N,)."""
        true = self.tables.odometry(self.start, self.state, self._origin)
        return (self.odometry() - true)[:, :2].double().norm(dim=1)

    def observe_exploration(self) -> tuple[TensorDict, Tensor]:
        """Return the observations along the exploration trajectories, without audio.

        Returns
        -------
        trajectories : TensorDict of batch size (W, T)
            `collided`, `odometry` since the start of the trajectory, and the visual observations,
            as in `observe`.
        trajectory_index : (N,) int64
            Trajectory of each episode.
        """
        from tensordict import TensorDict

        trajectories = torch.from_numpy(self.episodes.trajectories)
        observed = {
            "collided": torch.zeros(trajectories.shape, dtype=torch.bool),
            "odometry": self.tables.odometry(trajectories[:, :1], trajectories),
        }
        observed |= {name: seen[trajectories] for name, seen in self.tables.visual.items()}
        return TensorDict(observed, batch_size=trajectories.shape), torch.from_numpy(
            self.episodes.trajectory_index
        )

    def clip(self) -> ClipId:
        """Return the clip that each agent hears now; each action has its own realisation."""
        if self._realisations is None:
            first = torch.zeros_like(self.state)
            return ClipId(self.source, self.state, self.sound, first)
        draws = self.protocol.max_actions + 1
        row = torch.arange(len(self)) * draws + self.actions
        return ClipId(self.source, self.state, self.sound, self._realisations[row].long())

    def _drawn(self) -> Tensor | None:
        if self.tables.realisations == 1:
            return None
        draws = self.protocol.max_actions + 1
        return drawn_realisations(self.episodes, draws, self.tables.realisations).reshape(-1)

    def _check(self, actions: Tensor) -> None:
        error = action_error(actions, len(self), self.protocol.actions, self.protocol.name)
        if error:
            raise ValueError(error)


def drawn_realisations(
    episodes: Episodes, draws: int, realisations: int, rows: Sequence[int] | None = None
) -> Tensor:
    """Draw the realisation that each episode hears after each number of actions.

    Parameters
    ----------
    episodes : Episodes
        Their keys determine the draws.
    draws : int
        Numbers of actions, counted from 0.
    realisations : int
        Realisations of each clip.
    rows : sequence of int, optional
        Episodes to draw for; all by default.

    Returns
    -------
    (N, draws) int16 tensor
    """
    keys, steps = episodes.keys(), np.arange(draws)
    keys = keys if rows is None else keys[rows]
    table = np.empty((len(keys), draws), dtype=np.int16)
    for begin in range(0, len(keys), _CHUNK):
        part = slice(begin, begin + _CHUNK)
        table[part] = scramble(keys[part, None], steps[None, :]) % np.uint64(realisations)
    return torch.from_numpy(table)
