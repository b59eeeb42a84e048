"""Apartments as tables, laid out one after another, in which a step is a lookup."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.core.actions import ACTIONS, BACKWARD, HEADINGS, transitions
from avn.core.clip_id import ClipId
from avn.navigation.distances import measure
from avn.navigation.observations import SceneObservations
from avn.navigation.place import Place
from avn.navigation.protocols import Protocol

# Unit vectors (east, north) to the right and to the front of headings north, east, south, west.
_RIGHT = np.array([(1, 0), (0, -1), (-1, 0), (0, 1)])
_FRONT = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])


@dataclass(frozen=True)
class SceneBatch:
    """R apartments with S states in all and Q sources in all; a state counts through all of them.

    Everything is a tensor or a plain value, so that it travels to other processes; `share` puts it
    where they need no copy of their own.

    Attributes
    ----------
    following : (S * 5,) int64
        The state that each action leads to.
    room : (S,) int64
        The apartment of each state.
    first_state : (R + 1,) int64
        Where each apartment's states begin.
    source_room : (Q,) int64
        The apartment of each source.
    goal, goal_row : (...,) bool, (Q,) int64
        `goal[goal_row[source] + state]`: whether an agent succeeds there.
    moves : (...,) int64
        Moves to the source's cell, as `goal` is laid out.
    clip_row : (Q,) int64
        Where the clips of each source begin; see `clip`.
    sounds, realisations : int
        How many there are of each clip.
    places : (4 * S, 3) int64
        See `positions`.
    audio : dict of str to (clips, ...) tensor
    visual : dict of str to (S, ...) tensor
    """

    following: Tensor
    room: Tensor
    first_state: Tensor
    source_room: Tensor
    goal: Tensor
    goal_row: Tensor
    moves: Tensor
    clip_row: Tensor
    sounds: int
    realisations: int
    places: Tensor
    audio: dict[str, Tensor]
    visual: dict[str, Tensor]

    @property
    def states(self) -> int:
        """S, the states of all apartments."""
        return len(self.room)

    @property
    def clips_of_state(self) -> int:
        """Clips of one source in one state."""
        return self.sounds * self.realisations

    @property
    def clips(self) -> int:
        """Clips of all sources in all states."""
        return len(self.goal) * self.clips_of_state

    def clip(self, clip: ClipId) -> Tensor:
        """The rows of clips in the tensors of `audio`, (N,) int64."""
        first = self.clip_row[clip.source] + clip.state * self.clips_of_state
        return first + clip.sound * self.realisations + clip.realisation

    def origin(self, start: Tensor) -> tuple[Tensor, Tensor]:
        """The rows of `places` as seen from starts begin here, and the places of the starts."""
        frame = start % HEADINGS * self.states
        return frame, self.places[frame + start]

    def odometry(
        self, start: Tensor, state: Tensor, origin: tuple[Tensor, Tensor] | None = None
    ) -> Tensor:
        """How states lie as seen from starts, which broadcast against them.

        Parameters
        ----------
        start, state : int64 tensors
        origin : (Tensor, Tensor), optional
            What `origin` gave for the starts, to save looking it up at every step.

        Returns
        -------
        (..., 3) int64
            Cells to the right and to the front and quarter turns clockwise, in the frame of the
            start.
        """
        frame, begin = origin or self.origin(start)
        return self.places[frame + state] - begin

    def share(self) -> SceneBatch:
        """Move all tensors to shared memory; returns itself."""
        for value in vars(self).values():
            for tensor in value.values() if isinstance(value, dict) else [value]:
                if isinstance(tensor, Tensor):
                    tensor.share_memory_()
        return self


def advance(
    tables: SceneBatch, goal_row: Tensor, state: Tensor, action: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Move N agents by one action: the one rule of motion, for evaluation and for training.

    Parameters
    ----------
    tables : Tables
    goal_row, state : (N,) int64
        `tables.goal_row` of the source that each agent seeks, and where it is.
    action : (N,) int64
        See `avn.core.actions`.

    Returns
    -------
    state : (N,) int64
        Where each is now; a blocked move leads back to where it began.
    blocked : (N,) bool
        Whether a move was tried and could not be made.
    arrived : (N,) bool
        Whether it is now at the goal, whatever it did.
    """
    following = tables.following[state * ACTIONS + action]
    blocked = (action <= BACKWARD) & (following == state)
    return following, blocked, tables.goal[goal_row + following]


def build_scene_batch(
    places: Sequence[Place],
    protocol: Protocol,
    observations: Sequence[SceneObservations] = (),
    sounds: int = 1,
) -> SceneBatch:
    """Lay out apartments.

    Parameters
    ----------
    places : sequence of Place
    protocol : Protocol
        Where agents succeed.
    observations : sequence of SceneObservations, optional
        What can be observed in each apartment, the same in all.
    sounds : int
        How many sounds there are where nothing is heard.
    """
    observed = [*observations] or [SceneObservations()] * len(places)
    states = np.cumsum([0] + [HEADINGS * len(place.grid.lattice) for place in places])
    sounds, realisations = observed[0].sounds or sounds, observed[0].realisations
    for place, own, count in zip(places, observed, np.diff(states), strict=True):
        own.check(len(place.sources), int(count), sounds)
    distances = [measure(place, protocol) for place in places]
    sources = [len(place.sources) for place in places]
    offsets = torch.from_numpy(states[:-1])
    source_room = torch.from_numpy(np.repeat(np.arange(len(places)), sources))
    # the rows of all sources of an apartment, then those of the next
    own_states = torch.from_numpy(np.diff(states))[source_room]
    row = torch.cumsum(own_states, 0) - own_states - offsets[source_room]
    return SceneBatch(
        following=_laid_out([transitions(p.grid.neighbours) for p in places], offsets),
        room=torch.from_numpy(np.repeat(np.arange(len(places)), np.diff(states))),
        first_state=torch.from_numpy(states),
        source_room=source_room,
        goal=_by_state([d.goal for d in distances]),
        goal_row=row,
        moves=_by_state([d.source_moves for d in distances]),
        clip_row=row * sounds * realisations,
        sounds=sounds,
        realisations=realisations,
        places=_places(places),
        audio={
            name: _joined([own.audio[name].flatten(0, 3) for own in observed])
            for name in observed[0].audio
        },
        visual={
            name: _joined([own.visual[name] for own in observed]) for name in observed[0].visual
        },
    )


def _joined(tensors: Sequence[Tensor]) -> Tensor:
    return tensors[0] if len(tensors) == 1 else torch.cat([*tensors])  # one needs no copy


def _laid_out(tables: Sequence[np.ndarray], offsets: Tensor) -> Tensor:
    moved = [torch.from_numpy(t) + offset for t, offset in zip(tables, offsets, strict=True)]
    return torch.cat(moved).reshape(-1)


def _by_state(tables: Sequence[np.ndarray]) -> Tensor:
    """(K, C) of each apartment, repeated for the four headings of a cell, one after another."""
    return torch.cat([torch.from_numpy(np.repeat(t, HEADINGS, axis=1)).flatten() for t in tables])


def _places(places: Sequence[Place]) -> Tensor:
    each = [positions(p.grid.lattice).unflatten(0, (HEADINGS, -1)) for p in places]
    return torch.cat(each, dim=1).flatten(0, 1)


def positions(lattice: NDArray[np.int32]) -> Tensor:
    """Where a state lies as an agent sees it that faces each heading, (4 x 4 C, 3) int64.

    By heading of the beholder and state: cells to the right and to the front from the lattice's
    origin, and quarter turns clockwise from the beholder's heading.
    """
    axes = np.stack((_RIGHT, _FRONT), axis=1)
    place = np.repeat(lattice @ axes.transpose(0, 2, 1), HEADINGS, axis=1)
    turn = (np.arange(HEADINGS)[None, :] - np.arange(HEADINGS)[:, None]) % HEADINGS
    turns = np.tile(turn, (1, len(lattice)))[:, :, None]
    return torch.from_numpy(np.concatenate((place, turns), axis=2).reshape(-1, 3).astype(np.int64))
