"""Traces: what happened in an episode step by step, and what the agent took to be true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avn.core.actions import HEADINGS
from avn.navigation.place import Place


@dataclass(frozen=True)
class BeliefTrace:
    """What an agent with a map took to be true at each of T steps, in the apartment's own frame.

    Attributes
    ----------
    pose : (T, 3) float64
        East and north in metres, and heading, where it took itself to be.
    low : (2,) int64
        Lattice indices (x, y) of the first square of `free`.
    free : (T, H, W) uint8, or None
        How surely each square is free, 0 to 255, by y and x; 128 tells nothing.
    similarity : (T, k) float32, or None
        Cosine of what it saw and the entries that its memory returned.
    retrieved : (T, k, 3) float64, or None
        East, north and heading of these entries.
    """

    pose: NDArray[np.float64]
    low: NDArray[np.int64]
    free: NDArray[np.uint8] | None
    similarity: NDArray[np.float32] | None
    retrieved: NDArray[np.float64] | None


@dataclass(frozen=True)
class Trace:
    """An episode of T actions.

    Attributes
    ----------
    place : Place
    record : mapping
        Its row of `episodes.csv`.
    sound, source : int
        Index into the run's sounds and the place's sources.
    state : (T + 1,) int64
        4 x cell + heading; the last is where it ended.
    action : (T,) int64
    collided : (T + 1,) bool
        Whether the action before was a blocked move.
    realisation : (T + 1,) int64
        Which take of the clip of source, state and sound is heard.
    source_estimates : (T + 1, 2) float64, or None
        East and north in metres of where the sound network took the source to be.
    beliefs : BeliefTrace, or None
        Of an agent with a map.
    walk : (W,) int64, or None
        States of the exploration walk, where the agent was shown one.
    """

    place: Place
    record: Mapping[str, Any]
    sound: int
    source: int
    state: NDArray[np.int64]
    action: NDArray[np.int64]
    collided: NDArray[np.bool_]
    realisation: NDArray[np.int64]
    source_estimates: NDArray[np.float64] | None
    beliefs: BeliefTrace | None
    walk: NDArray[np.int64] | None

    @property
    def path(self) -> NDArray[np.float64]:
        """East and north in metres at each step, (T + 1, 2)."""
        return self.place.grid.centres[self.state // HEADINGS]

    @property
    def goal(self) -> NDArray[np.float64]:
        """East and north of the source, (2,)."""
        return self.place.grid.centres[self.place.sources[self.source]]
