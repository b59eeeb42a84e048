"""Option `options` of `reset`: scene, source, start and sound of the next episodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.integrations.world import World
from avn.rl.environment import NavigationEnv

_KEYS = ("scene", "source", "start", "sound")


def place(env: NavigationEnv, world: World, rows: torch.Tensor, options: Mapping[str, Any]) -> None:
    """Set what `options` names in episodes that have just begun.

    Parameters
    ----------
    env : NavigationEnv
        Environment of N episodes.
    world : World
        Its apartments.
    rows : (N,) bool tensor
        Episodes that have begun.
    options : mapping
        `scene`: name of the apartment; `source`: number of the source in it; `start`: (cell,
        heading), or the state 4 * cell + heading; `sound`: name of the sound. What is not given is
        drawn.

    Raises
    ------
    UserError
        If an option is not known or its value does not exist.
    """
    for key in options:
        if key not in _KEYS:
            raise UserError(f"options: '{key}' is none of {', '.join(_KEYS)}")
    if world.part == "test":
        raise UserError("options: the episodes of part='test' are fixed; give another part")
    episodes, n = env.episodes, env.episodes.n
    sound = start = source = None
    if "sound" in options:
        sound = _all(n, _index("sound", options["sound"], world.sounds))
    if {"scene", "source", "start"} & set(options):
        number = _scene(world, options)
        low, high = world.tables.first_state[number : number + 2].tolist()
        first = int(world.tables.first_source()[number])
        sources = len(world.scenes[number].sources)
        if "source" in options:
            source = _all(n, first + _whole("source", options["source"], sources))
        else:
            source = first + torch.randint(sources, (n,), generator=episodes.generator)
        if "start" in options:
            state = _state(options["start"], high - low)
            start = _all(n, low + state)
            source = _away(world, source, start, "source" in options, first, sources)
    episodes.place(rows, source, start, sound)
    env.forget(rows)


def _scene(world: World, options: Mapping[str, Any]) -> int:
    names = [scene.name for scene in world.scenes]
    if "scene" in options:
        return _index("scene", options["scene"], names)
    if len(names) > 1:
        raise UserError(f"options: give 'scene' too, one of {', '.join(names)}")
    return 0


def _away(
    world: World, source: torch.Tensor, start: torch.Tensor, given: bool, first: int, sources: int
) -> torch.Tensor:
    """Return the sources, or another one where it was drawn and the start is at its goal."""
    tables = world.tables
    every = torch.arange(first, first + sources)
    away = every[~tables.goal[tables.goal_row[every] + start[0]]]
    if not len(away) or (given and int(source[0]) not in away.tolist()):
        raise UserError("options: the start is at the goal of the source; give another start")
    at_goal = tables.goal[tables.goal_row[source] + start]
    return torch.where(at_goal, away[source % len(away)], source)


def _state(start: Any, states: int) -> int:
    if np.ndim(start) == 0:
        return _whole("start", start, states)
    if len(start) != 2:
        raise UserError(f"options: start {start!r}; give (cell, heading), or 4 * cell + heading")
    cell = _whole("start", start[0], states // HEADINGS)
    return HEADINGS * cell + _whole("heading of start", start[1], HEADINGS)


def _index(key: str, value: Any, names: list[str]) -> int:
    if value not in names:
        raise UserError(f"options: {key} {value!r} is none of {', '.join(names)}")
    return names.index(value)


def _whole(key: str, value: Any, count: int) -> int:
    is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not is_whole or not 0 <= value < count:
        raise UserError(f"options: {key} {value!r}; give an integer from 0 to {count - 1}")
    return int(value)


def _all(n: int, value: int) -> torch.Tensor:
    return torch.full((n,), value)
