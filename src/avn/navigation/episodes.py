"""Which episodes a room has: frozen lists for each seed, or every start there is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.errors import UserError
from avn.navigation.actions import HEADINGS
from avn.navigation.exploration import explore, first_visits
from avn.navigation.hashing import derive, scramble
from avn.navigation.place import Place
from avn.navigation.protocols import Protocol

# Draws of the exploration walk before it is cut short instead.
TRIES = 16


@dataclass(frozen=True)
class Episodes:
    """N episodes of one room: sound by sound, source by source, start by start.

    Attributes
    ----------
    room : str
    seed : int
    sounds : tuple of str
        What `sound` counts.
    number : (N,) int64
        The episode's number in the room; the same for all sounds.
    sound, source, start : (N,) int64
        Index into `sounds`, index into the place's sources, state where the agent begins.
    walks : tuple of arrays of int64
        The exploration walk of each source, as states; empty where there is none.
    """

    room: str
    seed: int
    sounds: tuple[str, ...]
    number: NDArray[np.int64]
    sound: NDArray[np.int64]
    source: NDArray[np.int64]
    start: NDArray[np.int64]
    walks: tuple[NDArray[np.int64], ...] = ()

    def __len__(self) -> int:
        return len(self.start)

    def keys(self) -> NDArray[np.uint64]:
        """The key of each episode's random numbers, (N,); the same for every agent."""
        room = np.uint64(derive("episode", self.seed, self.room))
        # by its name, so that a sound is heard alike whichever others are beside it
        names = np.array([derive("sound", name) for name in self.sounds], dtype=np.uint64)
        return scramble(scramble(scramble(room, self.source), self.start), names[self.sound])


def frozen_episodes(
    place: Place,
    sounds: Sequence[str],
    protocol: Protocol,
    seed: int,
    visited: NDArray[np.bool_] | None = None,
) -> Episodes:
    """The frozen list of a room: `protocol.starts` episodes for each source and sound.

    Starts are drawn uniformly, without repeats, from the states that are neither at the goal nor
    on the exploration walk of their source. The list is a function of the seed, the room's name
    and its grid: all agents and all sounds get the same. A walk that leaves too few starts is
    drawn again, up to 16 times; in an apartment so small that every walk covers it, the first one
    is cut short where it would take the last starts.

    Parameters
    ----------
    place : Place
    sounds : sequence of str
    protocol : Protocol
    seed : int
    visited : (C,) or (K, C) bool, optional
        Cells of a walk that was made elsewhere, which takes the place of the drawn one.

    Raises
    ------
    UserError
        Where the room has fewer starts than `protocol.starts` for one of its sources.
    """
    grid, sources = place.grid, np.asarray(place.sources)
    cells, wanted = len(grid.lattice), protocol.starts
    allowed = ~protocol.goal_cells(grid, sources)
    if visited is not None:
        allowed = allowed & ~visited
    _check_enough(place.name, allowed, wanted)
    walks: tuple[NDArray[np.int64], ...] = ()
    if visited is None and protocol.exploration:
        walks, allowed = _explored(place, allowed, protocol, seed)
    states = np.arange(HEADINGS * cells)
    keys = _source_keys("starts", seed, place)
    # The order of all states is drawn first and then sifted, so that protocols and walks that
    # allow nearly the same starts get nearly the same ones.
    order = np.argsort(scramble(keys[:, None], states[None, :]), axis=1, kind="stable")
    kept = np.take_along_axis(allowed, order // HEADINGS, axis=1)
    first = np.argsort(~kept, axis=1, kind="stable")[:, :wanted]
    starts = np.take_along_axis(order, first, axis=1)
    source = np.repeat(np.arange(len(sources)), wanted)
    return _over_sounds(place, sounds, seed, source, starts.reshape(-1), walks)


def exhaustive_episodes(
    place: Place, sounds: Sequence[str], protocol: Protocol, seed: int
) -> Episodes:
    """Every start that is not at the goal, for each source and sound; no exploration walk.

    The seed only names the random numbers that the episodes use on their way.
    """
    allowed = ~protocol.goal_cells(place.grid, np.asarray(place.sources))
    _check_enough(place.name, allowed, 1)
    source, start = np.nonzero(np.repeat(allowed, HEADINGS, axis=1))
    return _over_sounds(place, sounds, seed, source, start, ())


def _check_enough(room: str, allowed: NDArray[np.bool_], wanted: int) -> None:
    starts = HEADINGS * int(allowed.sum(axis=1).min())
    if starts < wanted:
        raise UserError(
            f"protocol.starts: room '{room}' has only {starts} starts away from a source, and "
            f"{wanted} are asked for; ask for fewer or take a larger apartment"
        )


def _source_keys(purpose: str, seed: int, place: Place) -> NDArray[np.uint64]:
    """One key for each source of the place, (K,)."""
    key = np.uint64(derive(purpose, seed, place.name))
    return scramble(key, np.arange(len(place.sources)))


def _explored(
    place: Place, allowed: NDArray[np.bool_], protocol: Protocol, seed: int
) -> tuple[tuple[NDArray[np.int64], ...], NDArray[np.bool_]]:
    """The exploration walk of each source, and which cells it leaves as starts, (K, C)."""
    sources, cells = allowed.shape
    keys = scramble(_source_keys("exploration", seed, place)[:, None], np.arange(TRIES)[None, :])
    tried = explore(place.grid.neighbours, keys.reshape(-1), protocol.exploration)
    tried = tried.reshape(sources, TRIES, -1)
    least = -(-protocol.starts // HEADINGS)
    walks, left = [], []
    for own, free in zip(tried, allowed, strict=True):
        visits = first_visits(own, cells)
        unvisited = (visits > protocol.exploration) & free
        # The first try that leaves enough, or try 0, which is then cut.
        chosen = int(np.argmax(unvisited.sum(axis=1) >= least))
        # Cut at the step when the walk would take one of the last cells that are needed.
        end = int(np.sort(visits[chosen][free])[-least])
        walks.append(own[chosen][:end])
        left.append(free & (visits[chosen] >= end))
    return tuple(walks), np.stack(left)


def _over_sounds(
    place: Place,
    sounds: Sequence[str],
    seed: int,
    source: NDArray[np.int64],
    start: NDArray[np.int64],
    walks: tuple[NDArray[np.int64], ...],
) -> Episodes:
    """The same starts for every sound."""
    if not sounds:
        raise UserError("sound: there is none; name at least one sound")
    times, count = len(sounds), len(start)
    return Episodes(
        room=place.name,
        seed=seed,
        sounds=tuple(sounds),
        number=np.tile(np.arange(count), times),
        sound=np.repeat(np.arange(times), count),
        source=np.tile(source.astype(np.int64), times),
        start=np.tile(start.astype(np.int64), times),
        walks=walks,
    )
