"""Which episodes a room has: frozen lists for each seed, or every start there is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.random import derive, scramble
from avn.navigation.exploration import EXPLORATIONS, own_walks, shared_walk
from avn.navigation.place import Place
from avn.navigation.protocols import Protocol


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
    walks : (W, T) int64
        Exploration walks as states; W = 0 where there is none.
    walk : (N,) int64
        Which of them belongs to each episode; -1 for none.
    """

    room: str
    seed: int
    sounds: tuple[str, ...]
    number: NDArray[np.int64]
    sound: NDArray[np.int64]
    source: NDArray[np.int64]
    start: NDArray[np.int64]
    walks: NDArray[np.int64]
    walk: NDArray[np.int64]

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
    exploration: str = "shared",
) -> Episodes:
    """The frozen list of a room: `protocol.num_starts` episodes for each source and sound.

    Starts are drawn uniformly, without repeats, from the states that are neither at the goal nor
    on the exploration walk. The list is a function of the seed, the room's name and its grid: all
    agents and all sounds get the same. A walk that leaves too few starts is drawn again, up to 16
    times; in an apartment so small that every walk covers it, the first one is cut short where it
    would take the last starts.

    Parameters
    ----------
    place : Place
    sounds : sequence of str
    protocol : Protocol
    seed : int
    exploration : {"shared", "own"}
        One walk for all episodes of the room, or one for each start, so that no two episodes
        know the same; then a state may be the start of two episodes.

    Raises
    ------
    UserError
        Where the room has fewer starts than `protocol.num_starts` for one of its sources.
    """
    if exploration not in EXPLORATIONS:
        raise UserError(f"exploration: '{exploration}' is none of {', '.join(EXPLORATIONS)}")
    grid, sources = place.grid, np.asarray(place.sources)
    cells, wanted = len(grid.lattice), protocol.num_starts
    goal = protocol.goal_cells(grid, sources)
    _check_enough(place.name, ~goal, wanted)
    source = np.repeat(np.arange(len(sources)), wanted)
    # The order of all states is drawn first and then sifted, so that protocols and walks that
    # allow nearly the same starts get nearly the same ones.
    states = np.arange(HEADINGS * cells)
    keys = _source_keys("starts", seed, place)
    order = np.argsort(scramble(keys[:, None], states[None, :]), axis=1, kind="stable")
    walk_key = np.uint64(derive("exploration", seed, place.name))
    if not protocol.exploration_steps:
        walks, walk = np.empty((0, 1), dtype=np.int64), np.full(len(source), -1)
        starts = _first_allowed(order, ~goal, wanted)
    elif exploration == "shared":
        shared, left = shared_walk(
            grid.neighbours, ~goal, walk_key, protocol.exploration_steps, wanted
        )
        walks, walk = shared[None], np.zeros(len(source), dtype=np.int64)
        starts = _first_allowed(order, left, wanted)
    else:
        each = np.arange(len(source))
        walks, left = own_walks(
            grid.neighbours, ~goal[source], scramble(walk_key, each), protocol.exploration_steps
        )
        walk, turned = each, (np.arange(wanted)[:, None] + states) % len(states)
        # every start of a source looks through the same order from another place on
        own = order[:, turned].reshape(len(source), -1)
        starts = _first_allowed(own, left, 1)
    return _over_sounds(place, sounds, seed, source, starts.reshape(-1), walks, walk)


def _first_allowed(
    order: NDArray[np.int64], allowed: NDArray[np.bool_], wanted: int
) -> NDArray[np.int64]:
    """The first states of each row of `order`, (R, S), whose cells are allowed, (R, C)."""
    kept = np.take_along_axis(allowed, order // HEADINGS, axis=1)
    first = np.argsort(~kept, axis=1, kind="stable")[:, :wanted]
    return np.take_along_axis(order, first, axis=1)


def exhaustive_episodes(
    place: Place, sounds: Sequence[str], protocol: Protocol, seed: int
) -> Episodes:
    """Every start that is not at the goal, for each source and sound; no exploration walk.

    The seed only names the random numbers that the episodes use on their way.
    """
    allowed = ~protocol.goal_cells(place.grid, np.asarray(place.sources))
    _check_enough(place.name, allowed, 1)
    source, start = np.nonzero(np.repeat(allowed, HEADINGS, axis=1))
    none = np.empty((0, 1), dtype=np.int64)
    return _over_sounds(place, sounds, seed, source, start, none, np.full(len(source), -1))


def _check_enough(room: str, allowed: NDArray[np.bool_], wanted: int) -> None:
    starts = HEADINGS * int(allowed.sum(axis=1).min())
    if starts < wanted:
        raise UserError(
            f"protocol.num_starts: room '{room}' has only {starts} starts away from a source, and "
            f"{wanted} are asked for; ask for fewer or take a larger apartment"
        )


def _source_keys(purpose: str, seed: int, place: Place) -> NDArray[np.uint64]:
    """One key for each source of the place, (K,)."""
    key = np.uint64(derive(purpose, seed, place.name))
    return scramble(key, np.arange(len(place.sources)))


def _over_sounds(
    place: Place,
    sounds: Sequence[str],
    seed: int,
    source: NDArray[np.int64],
    start: NDArray[np.int64],
    walks: NDArray[np.int64],
    walk: NDArray[np.int64],
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
        walk=np.tile(walk.astype(np.int64), times),
    )
