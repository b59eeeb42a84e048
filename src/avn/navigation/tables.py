"""Apartments as tables, laid out one after another, in which a step is a lookup."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from avn.core.actions import HEADINGS, transitions
from avn.navigation.distances import measure
from avn.navigation.place import Place
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import positions


@dataclass(frozen=True)
class Tables:
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
        `clip_row[source] + state * clips_of_state + sound * takes + take` is the row of a clip.
    sounds, takes : int
    places : (4 * S, 3) int64
        See `avn.navigation.simulator.positions`.
    hearing : dict of str to (clips, ...) tensor
    sights : dict of str to (S, ...) tensor
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
    takes: int
    places: Tensor
    hearing: dict[str, Tensor]
    sights: dict[str, Tensor]

    @property
    def states(self) -> int:
        """S, the states of all apartments."""
        return len(self.room)

    @property
    def clips_of_state(self) -> int:
        """Clips of one source in one state."""
        return self.sounds * self.takes

    @property
    def clips(self) -> int:
        """Clips of all sources in all states."""
        return len(self.goal) * self.clips_of_state

    def share(self) -> Tables:
        """Move all tensors to shared memory; returns itself."""
        for value in vars(self).values():
            for tensor in value.values() if isinstance(value, dict) else [value]:
                if isinstance(tensor, Tensor):
                    tensor.share_memory_()
        return self


def build_tables(
    places: Sequence[Place],
    protocol: Protocol,
    hearing: Sequence[Mapping[str, Tensor]] = (),
    sights: Sequence[Mapping[str, Tensor]] = (),
    sounds: int = 1,
) -> Tables:
    """Lay out apartments.

    Parameters
    ----------
    places : sequence of Place
    protocol : Protocol
        Where agents succeed.
    hearing : sequence of mapping of str to (K, S, sounds, takes, ...) tensor
        What is heard in each apartment, by name, as for `Simulator`.
    sights : sequence of mapping of str to (S, ...) tensor
        What is seen in each apartment, by name.
    sounds : int
        How many sounds there are where nothing is heard.
    """
    hearing, sights = [*hearing] or [{}] * len(places), [*sights] or [{}] * len(places)
    states = np.cumsum([0] + [HEADINGS * len(place.grid.lattice) for place in places])
    heard = {name: _laid_flat([own[name] for own in hearing]) for name in hearing[0]}
    first = next(iter(hearing[0].values()), None)
    takes = 1 if first is None else first.shape[3]
    distances = [measure(place, protocol) for place in places]
    sources = [len(place.sources) for place in places]
    offsets = torch.from_numpy(states[:-1])
    source_room = torch.from_numpy(np.repeat(np.arange(len(places)), sources))
    # the rows of all sources of an apartment, then those of the next
    own_states = torch.from_numpy(np.diff(states))[source_room]
    row = torch.cumsum(own_states, 0) - own_states - offsets[source_room]
    sounds = sounds if first is None else first.shape[2]
    return Tables(
        following=_laid_out([transitions(p.grid.neighbours) for p in places], offsets),
        room=torch.from_numpy(np.repeat(np.arange(len(places)), np.diff(states))),
        first_state=torch.from_numpy(states),
        source_room=source_room,
        goal=_by_state([d.goal for d in distances]),
        goal_row=row,
        moves=_by_state([d.source_moves for d in distances]),
        clip_row=row * sounds * takes,
        sounds=sounds,
        takes=takes,
        places=_places(places),
        hearing=heard,
        sights={name: torch.cat([own[name] for own in sights]) for name in sights[0]},
    )


def _laid_flat(heard: Sequence[Tensor]) -> Tensor:
    return torch.cat([own.flatten(0, 3) for own in heard])


def _laid_out(tables: Sequence[np.ndarray], offsets: Tensor) -> Tensor:
    moved = [torch.from_numpy(t) + offset for t, offset in zip(tables, offsets, strict=True)]
    return torch.cat(moved).reshape(-1)


def _by_state(tables: Sequence[np.ndarray]) -> Tensor:
    """(K, C) of each apartment, repeated for the four headings of a cell, one after another."""
    return torch.cat([torch.from_numpy(np.repeat(t, HEADINGS, axis=1)).flatten() for t in tables])


def _places(places: Sequence[Place]) -> Tensor:
    each = [positions(p.grid.lattice).unflatten(0, (HEADINGS, -1)) for p in places]
    return torch.cat(each, dim=1).flatten(0, 1)
