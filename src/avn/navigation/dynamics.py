"""What changes in the course of an episode: the sound, its place, a second source, the odometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from avn.core.random import derive, scramble
from avn.core.sound_mix import SoundMix
from avn.navigation.distractor import Distractor
from avn.navigation.episodes import Episodes
from avn.navigation.motion import Motion
from avn.navigation.navigation_scene import NavigationScene
from avn.navigation.odometry_noise import OdometryNoise
from avn.navigation.schedule import Schedule


@dataclass(frozen=True)
class Dynamics:
    """Parts of the world that change in the course of an episode; none by default.

    Attributes
    ----------
    schedule : Schedule, optional
        When the sound begins and ends.
    distractor : Distractor, optional
        A second source.
    odometry : OdometryNoise, optional
        Actions that fail unnoticed.
    motion : Motion, optional
        A walk of the source.
    """

    schedule: Schedule | None = None
    distractor: Distractor | None = None
    odometry: OdometryNoise | None = None
    motion: Motion | None = None

    @property
    def changes_sound(self) -> bool:
        """True if clips are heard that no table of all clips has."""
        return any((self.schedule, self.distractor, self.motion))


class Course:
    """Dynamics of N episodes, the same for every agent.

    Parameters
    ----------
    dynamics : Dynamics
        What changes.
    episodes : Episodes
        Their keys determine all draws.
    scene : NavigationScene
        Apartment of the episodes.
    actions : int
        Largest number of actions of an episode.

    Attributes
    ----------
    begin, end : (N,) float64
        Seconds at which the sound begins and ends; an action takes one second.
    other_source, other_sound : (N,) int64
        Source and sound of the distractor; -1 for none.
    walk : (N, actions + 1) int16, or None
        Cell of a moving source after each number of actions.
    """

    def __init__(
        self, dynamics: Dynamics, episodes: Episodes, scene: NavigationScene, actions: int
    ) -> None:
        self.dynamics = dynamics
        self._sources = len(scene.sources)
        keys = {
            part: scramble(episodes.keys(), derive(part) >> 1)
            for part in ("schedule", "distractor", "odometry", "motion")
        }
        self._keys = keys["odometry"]
        steady = SoundMix.steady(len(episodes))
        self.begin, self.end, self.other_source, self.other_sound, *_ = steady
        if dynamics.schedule:
            self.begin, self.end = dynamics.schedule.draw(keys["schedule"])
        if dynamics.distractor:
            self.other_source, self.other_sound = dynamics.distractor.draw(
                *(keys["distractor"], episodes.source, episodes.sound),
                *(self._sources, episodes.sounds),
            )
        self.walk: Tensor | None = None
        if dynamics.motion:
            cells = np.asarray(scene.sources)[episodes.source]
            walk = dynamics.motion.walk(keys["motion"], cells, scene.grid, actions)
            self.walk = torch.from_numpy(walk)

    def cells(self, rows: Tensor, actions: Tensor) -> Tensor:
        """Return the cells of moving sources after some numbers of actions, int64.

        Parameters
        ----------
        rows, actions : int64 tensors of one shape
            Episodes, and numbers of actions.
        """
        assert self.walk is not None
        return self.walk[rows, actions].long()

    def mix(self, actions: Tensor) -> SoundMix | None:
        """Return what N agents hear after some numbers of actions; None for the steady sound."""
        return self._heard(torch.arange(len(actions)), actions, actions)

    def of_episode(self, row: int, count: int, walked: int) -> SoundMix | None:
        """Return what is heard in each second of an episode.

        Parameters
        ----------
        row : int
            The episode.
        count, walked : int
            Number of its actions, and of those during which the source may move.
        """
        passed = torch.arange(count + 1)
        return self._heard(torch.full_like(passed, row), passed, passed.clamp(max=walked))

    def _heard(self, rows: Tensor, passed: Tensor, walked: Tensor) -> SoundMix | None:
        """Return what is heard after some numbers of actions, and of those of the source."""
        if not self.dynamics.changes_sound:
            return None
        begin, end = (times[rows] - passed.double() for times in (self.begin, self.end))
        place = before = torch.full_like(rows, -1)
        if self.walk is not None:
            # the responses of all cells follow those of the sources
            place = self._sources + self.cells(rows, walked)
            before = self._sources + self.cells(rows, (passed - 1).clamp(min=0).minimum(walked))
        other = self.other_source[rows], self.other_sound[rows]
        return SoundMix(begin, end, *other, place, before)

    def carried_out(self, actions: Tensor, counts: Tensor) -> tuple[Tensor, Tensor]:
        """Return what becomes of the actions of N agents.

        Parameters
        ----------
        actions : (N,) int64
            See `avn.core.actions`.
        counts : (N,) int64
            Number of actions before this one.

        Returns
        -------
        slips, twice : (N,) bool
            Actions without effect, and rotations that go twice as far.
        """
        if self.dynamics.odometry is None:
            none = torch.zeros_like(actions, dtype=torch.bool)
            return none, none
        return self.dynamics.odometry.failures(self._keys, counts, actions)
