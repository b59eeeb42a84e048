"""Episodes of a scene: a frozen list for each seed, or every possible start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.random import derive, scramble
from avn.navigation.exploration import EXPLORATIONS, own_trajectories, shared_trajectory
from avn.navigation.navigation_scene import NavigationScene
from avn.navigation.protocols import Protocol

# Lists of episodes: a frozen list of starts, walked with every sound or each with one sound, and
# every start.
FROZEN, ONE_SOUND, EXHAUSTIVE = "frozen", "one_sound", "exhaustive"
LISTS = (FROZEN, ONE_SOUND, EXHAUSTIVE)


@dataclass(frozen=True)
class Episodes:
    """N episodes of one scene.

    Attributes
    ----------
    scene : str
        Name of the scene.
    seed : int
        Seed of the starts, the exploration trajectories and the realisations.
    sounds : tuple of str
        Names of the sounds.
    number : (N,) int64
        Number of the episode in the scene; the same for all sounds.
    sound, source, start : (N,) int64
        Index into `sounds`, index into the scene's sources, and first state of the agent.
    trajectories : (W, T) int64
        States of the exploration trajectories; W = 0 if the protocol has none.
    trajectory_index : (N,) int64
        Row of `trajectories` of each episode; -1 for none.
    """

    scene: str
    seed: int
    sounds: tuple[str, ...]
    number: NDArray[np.int64]
    sound: NDArray[np.int64]
    source: NDArray[np.int64]
    start: NDArray[np.int64]
    trajectories: NDArray[np.int64]
    trajectory_index: NDArray[np.int64]

    def __len__(self) -> int:
        """Return N."""
        return len(self.start)

    def keys(self) -> NDArray[np.uint64]:
        """Return the key of each episode's random numbers, (N,); the same for every agent."""
        scene = np.uint64(derive("episode", self.seed, self.scene))
        # by name, so that the realisations of a sound do not depend on the other sounds
        names = np.array([derive("sound", name) for name in self.sounds], dtype=np.uint64)
        return scramble(scramble(scramble(scene, self.source), self.start), names[self.sound])


def frozen_episodes(
    scene: NavigationScene,
    sounds: Sequence[str],
    protocol: Protocol,
    seed: int,
    exploration: str = "shared",
    one_sound: bool = False,
) -> Episodes:
    """Draw the frozen list: `protocol.num_starts` episodes for each source and sound.

    Starts are drawn uniformly, without repeats, from the states that are neither at the goal nor
    on the exploration trajectory. The list is a function of the seed, the scene's name and its
    grid, so it is the same for all agents and sounds. A trajectory that leaves too few starts is
    drawn again, up to 16 times. If every draw covers a small apartment, the first trajectory is
    cut before it takes the last starts.

    Parameters
    ----------
    scene : NavigationScene
        Apartment of the episodes.
    sounds : sequence of str
        Names of the sounds.
    protocol : Protocol
        Goal, number of starts and exploration steps.
    seed : int
        Seed of starts and trajectories.
    exploration : {"shared", "own"}
        One trajectory for all episodes of the scene, or one for each start. With "own" a state
        may be the start of two episodes.
    one_sound : bool
        Whether each start is one episode, with one of the sounds, instead of one episode for each
        sound. The sounds are drawn by the seed, each as often as the others, give or take one.

    Returns
    -------
    Episodes

    Raises
    ------
    UserError
        If a source has fewer than `protocol.num_starts` starts, or there is no sound.
    """
    if exploration not in EXPLORATIONS:
        raise UserError(f"exploration: '{exploration}' is none of {', '.join(EXPLORATIONS)}")
    grid, sources = scene.grid, np.asarray(scene.sources)
    cells, wanted = len(grid.lattice), protocol.num_starts
    goal = protocol.goal_cells(grid, sources)
    _check_enough(scene.name, ~goal, wanted)
    source = np.repeat(np.arange(len(sources)), wanted)
    # The order of all states is drawn first and filtered afterwards, so that protocols and
    # trajectories that allow similar starts get similar starts.
    states = np.arange(HEADINGS * cells)
    keys = _source_keys("starts", seed, scene)
    order = np.argsort(scramble(keys[:, None], states[None, :]), axis=1, kind="stable")
    trajectory_key = np.uint64(derive("exploration", seed, scene.name))
    if not protocol.exploration_steps:
        trajectories, trajectory_index = np.empty((0, 1), dtype=np.int64), np.full(len(source), -1)
        starts = _first_allowed(order, ~goal, wanted)
    elif exploration == "shared":
        shared, left = shared_trajectory(
            grid.neighbours, ~goal, trajectory_key, protocol.exploration_steps, wanted
        )
        trajectories, trajectory_index = shared[None], np.zeros(len(source), dtype=np.int64)
        starts = _first_allowed(order, left, wanted)
    else:
        each = np.arange(len(source))
        trajectories, left = own_trajectories(
            grid.neighbours,
            ~goal[source],
            scramble(trajectory_key, each),
            protocol.exploration_steps,
        )
        trajectory_index, turned = each, (np.arange(wanted)[:, None] + states) % len(states)
        # each start of a source reads the same order from another offset
        own = order[:, turned].reshape(len(source), -1)
        starts = _first_allowed(own, left, 1)
    episodes = _over_sounds(
        scene, sounds, seed, source, starts.reshape(-1), trajectories, trajectory_index
    )
    return _with_one_sound(episodes, len(source)) if one_sound else episodes


def _with_one_sound(episodes: Episodes, starts: int) -> Episodes:
    """Keep one episode of each start, with a sound drawn without replacement until all are used."""
    key = np.uint64(derive("one sound", episodes.seed, episodes.scene))
    rank = np.argsort(np.argsort(scramble(key, np.arange(starts)), kind="stable"), kind="stable")
    # the sounds in an order of their own too, as some are left over where there are many
    names = np.array([derive("sound", name) for name in episodes.sounds], dtype=np.uint64)
    order = np.argsort(scramble(key, names), kind="stable")
    sound = order[rank % len(order)]
    rows = sound * starts + np.arange(starts)
    chosen = {
        name: getattr(episodes, name)[rows]
        for name in ("number", "sound", "source", "start", "trajectory_index")
    }
    return replace(episodes, **chosen)


def _first_allowed(
    order: NDArray[np.int64], allowed: NDArray[np.bool_], wanted: int
) -> NDArray[np.int64]:
    """Return the first states of each row of `order`, (R, S), whose cells are allowed, (R, C)."""
    kept = np.take_along_axis(allowed, order // HEADINGS, axis=1)
    first = np.argsort(~kept, axis=1, kind="stable")[:, :wanted]
    return np.take_along_axis(order, first, axis=1)


def exhaustive_episodes(
    scene: NavigationScene, sounds: Sequence[str], protocol: Protocol, seed: int
) -> Episodes:
    """List every start that is not at the goal, for each source and sound.

    The episodes have no exploration trajectory.

    Parameters
    ----------
    scene : NavigationScene
        Apartment of the episodes.
    sounds : sequence of str
        Names of the sounds.
    protocol : Protocol
        Defines the goal cells.
    seed : int
        Seed of the realisations; the starts do not depend on it.

    Returns
    -------
    Episodes

    Raises
    ------
    UserError
        If a source has no start, or there is no sound.
    """
    allowed = ~protocol.goal_cells(scene.grid, np.asarray(scene.sources))
    _check_enough(scene.name, allowed, 1)
    source, start = np.nonzero(np.repeat(allowed, HEADINGS, axis=1))
    none = np.empty((0, 1), dtype=np.int64)
    return _over_sounds(scene, sounds, seed, source, start, none, np.full(len(source), -1))


def _check_enough(scene: str, allowed: NDArray[np.bool_], wanted: int) -> None:
    starts = HEADINGS * int(allowed.sum(axis=1).min())
    if starts < wanted:
        raise UserError(
            f"protocol.num_starts: scene '{scene}' has only {starts} starts away from a source, "
            f"and {wanted} are asked for; ask for fewer or take a larger apartment"
        )


def _source_keys(purpose: str, seed: int, scene: NavigationScene) -> NDArray[np.uint64]:
    """Return one key for each source of the scene, (K,)."""
    key = np.uint64(derive(purpose, seed, scene.name))
    return scramble(key, np.arange(len(scene.sources)))


def _over_sounds(
    scene: NavigationScene,
    sounds: Sequence[str],
    seed: int,
    source: NDArray[np.int64],
    start: NDArray[np.int64],
    trajectories: NDArray[np.int64],
    trajectory_index: NDArray[np.int64],
) -> Episodes:
    """Repeat the same starts for every sound."""
    if not sounds:
        raise UserError("sound: there is none; name at least one sound")
    times, count = len(sounds), len(start)
    return Episodes(
        scene=scene.name,
        seed=seed,
        sounds=tuple(sounds),
        number=np.tile(np.arange(count), times),
        sound=np.repeat(np.arange(times), count),
        source=np.tile(source.astype(np.int64), times),
        start=np.tile(start.astype(np.int64), times),
        trajectories=trajectories,
        trajectory_index=np.tile(trajectory_index.astype(np.int64), times),
    )
