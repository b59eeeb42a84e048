"""What changes in the course of an episode: the sound, a second source, the odometry's error."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avn.core.random import derive, scramble
from avn.core.sound_mix import SoundMix
from avn.navigation.distractor import Distractor
from avn.navigation.episodes import Episodes
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
    """

    schedule: Schedule | None = None
    distractor: Distractor | None = None
    odometry: OdometryNoise | None = None

    @property
    def changes_sound(self) -> bool:
        """True if clips are heard that no table of all clips has."""
        return self.schedule is not None or self.distractor is not None


class Course:
    """Dynamics of N episodes, the same for every agent.

    Parameters
    ----------
    dynamics : Dynamics
        What changes.
    episodes : Episodes
        Their keys determine all draws.
    sources : int
        Number of sources of the apartment.

    Attributes
    ----------
    begin, end : (N,) float64
        Seconds at which the sound begins and ends; an action takes one second.
    other_source, other_sound : (N,) int64
        Source and sound of the distractor; -1 for none.
    """

    def __init__(self, dynamics: Dynamics, episodes: Episodes, sources: int) -> None:
        self.dynamics = dynamics
        keys = {
            part: scramble(episodes.keys(), derive(part) >> 1)
            for part in ("schedule", "distractor", "odometry")
        }
        self._keys = keys["odometry"]
        steady = SoundMix.steady(len(episodes))
        self.begin, self.end, self.other_source, self.other_sound = steady
        if dynamics.schedule:
            self.begin, self.end = dynamics.schedule.draw(keys["schedule"])
        if dynamics.distractor:
            self.other_source, self.other_sound = dynamics.distractor.draw(
                keys["distractor"], episodes.source, episodes.sound, sources, episodes.sounds
            )

    def mix(self, actions: Tensor) -> SoundMix | None:
        """Return what N agents hear after some numbers of actions; None for the steady sound."""
        if not self.dynamics.changes_sound:
            return None
        passed = actions.double()
        return SoundMix(self.begin - passed, self.end - passed, self.other_source, self.other_sound)

    def of_episode(self, row: int, count: int) -> SoundMix | None:
        """Return what is heard in each second of an episode of `count` actions."""
        if not self.dynamics.changes_sound:
            return None
        passed = torch.arange(count + 1).double()
        source, sound = (
            part[row].expand(count + 1) for part in (self.other_source, self.other_sound)
        )
        return SoundMix(self.begin[row] - passed, self.end[row] - passed, source, sound)

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
