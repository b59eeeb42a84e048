"""Traces of episodes step by step, with the beliefs of the agent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avn.core.actions import HEADINGS
from avn.core.sound_mix import SoundMix
from avn.navigation.navigation_scene import NavigationScene


@dataclass(frozen=True)
class BeliefTrace:
    """Beliefs of an agent with a map at each of T steps, in the frame of the apartment.

    Attributes
    ----------
    pose : (T, 3) float64
        Estimated pose: metres east, metres north and heading.
    low : (2,) int64
        Lattice indices (x, y) of the first square of `free`.
    free : (T, H, W) uint8, or None
        Probability that each square is free, scaled to 0 to 255, by y and x; 128 is unknown.
    posterior : (T, H, W) uint8, or None
        Probability that each square has the source, scaled so that the likeliest one of its map
        has 255.
    similarity : (T, k) float32, or None
        Cosine similarity of the view and the entries that the spatial memory returned.
    retrieved : (T, k, 3) float64, or None
        Metres east, metres north and heading of these entries.
    """

    pose: NDArray[np.float64]
    low: NDArray[np.int64]
    free: NDArray[np.uint8] | None
    posterior: NDArray[np.uint8] | None
    similarity: NDArray[np.float32] | None
    retrieved: NDArray[np.float64] | None


@dataclass(frozen=True)
class Trace:
    """Trace of an episode of T actions.

    Attributes
    ----------
    scene : NavigationScene
        Apartment of the episode.
    record : mapping
        Row of `episodes.csv`.
    sound, source : int
        Index into the sounds of the run and into the sources of the scene.
    state : (T + 1,) int64
        4 x cell + heading, from the start to the last state.
    action : (T,) int64
        See `avn.core.actions`.
    collided : (T + 1,) bool
        True if the action before was a blocked move.
    realisation : (T + 1,) int64
        Realisation of the clip that is heard.
    source_estimates : (T + 1, 2) float64, or None
        Location of the source as the sound network estimates it, metres east and north.
    beliefs : BeliefTrace, or None
        Beliefs of an agent with a map.
    exploration_trajectory : (W,) int64, or None
        States of the exploration trajectory of an agent that explores.
    mix : SoundMix, or None
        When and where the source sounds in each of the T + 1 seconds, and the distractor; None
        for the steady sound of the source.
    """

    scene: NavigationScene
    record: Mapping[str, Any]
    sound: int
    source: int
    state: NDArray[np.int64]
    action: NDArray[np.int64]
    collided: NDArray[np.bool_]
    realisation: NDArray[np.int64]
    source_estimates: NDArray[np.float64] | None
    beliefs: BeliefTrace | None
    exploration_trajectory: NDArray[np.int64] | None
    mix: SoundMix | None = None

    @property
    def path(self) -> NDArray[np.float64]:
        """Positions at each step, metres east and north, (T + 1, 2)."""
        return self.scene.grid.centres[self.state // HEADINGS]

    @property
    def goal(self) -> NDArray[np.float64]:
        """Position of the source at the beginning, metres east and north, (2,)."""
        return self.scene.grid.centres[self.scene.sources[self.source]]

    @property
    def goals(self) -> NDArray[np.float64]:
        """Positions of the source at each step, metres east and north, (T + 1, 2)."""
        sources = np.asarray(self.scene.sources)
        cells = np.full(len(self.state), sources[self.source])
        if self.mix is not None:
            walk = self.mix.place.numpy() - len(sources)
            cells = np.where(self.mix.place.numpy() < 0, cells, walk)
        return self.scene.grid.centres[cells]

    @property
    def distractor(self) -> NDArray[np.float64] | None:
        """Position of the distractor, metres east and north, (2,); None without one."""
        if self.mix is None or self.mix.other_source[0] < 0:
            return None
        return self.scene.grid.centres[self.scene.sources[int(self.mix.other_source[0])]]
