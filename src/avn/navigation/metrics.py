"""Metrics of embodied navigation.

All metrics take arrays of N episodes and return one value for each; tables show the mean.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]


def spl(success: ArrayLike, path: ArrayLike, shortest: ArrayLike) -> Floats:
    """Compute success weighted by path length (SPL): S l / max(p, l).

    Anderson et al., "On Evaluation of Embodied Navigation Agents", 2018.

    Parameters
    ----------
    success : (N,) array_like
        S, 1 for success and 0 for failure.
    path : (N,) array_like
        p, the length of the path, in the unit of `shortest`.
    shortest : (N,) array_like
        l, the length of the shortest path; above 0.

    Returns
    -------
    (N,) float64
    """
    taken, best = np.asarray(path, dtype=np.float64), np.asarray(shortest, dtype=np.float64)
    return np.asarray(success, dtype=np.float64) * best / np.maximum(taken, best)


def soft_spl(remaining: ArrayLike, path: ArrayLike, shortest: ArrayLike) -> Floats:
    """Compute SoftSPL, SPL with progress in place of success: max(0, 1 - d / l) l / max(p, l).

    Datta et al., "Integrating Egocentric Localization for More Realistic Point-Goal Navigation
    Agents", 2020.

    Parameters
    ----------
    remaining : (N,) array_like
        d, the length of the shortest path from the last position, in the unit of `shortest`.
    path : (N,) array_like
        p, the length of the path, in the unit of `shortest`.
    shortest : (N,) array_like
        l, the length of the shortest path from the start; above 0.

    Returns
    -------
    (N,) float64
    """
    progress = 1.0 - np.asarray(remaining, dtype=np.float64) / np.asarray(shortest)
    return spl(np.maximum(progress, 0.0), path, shortest)


def sna(success: ArrayLike, actions: ArrayLike, fewest: ArrayLike) -> Floats:
    """Compute success weighted by number of actions (SNA): S a* / max(a, a*).

    Chen et al., "Learning to Set Waypoints for Audio-Visual Navigation", 2021. The column `sna` of
    a run takes a* to the cell of the source, as SoundSpaces does; `sna_goal` takes the fewest
    actions that succeed, which are usually fewer, since goal cells lie around the source.

    Parameters
    ----------
    success : (N,) array_like
        S, 1 for success and 0 for failure.
    actions : (N,) array_like
        a, the number of actions, including rotations and Stop.
    fewest : (N,) array_like
        a*, the fewest actions of an episode, including rotations and Stop; above 0.

    Returns
    -------
    (N,) float64
    """
    return spl(success, actions, fewest)


def dynamic_spl(success: ArrayLike, actions: ArrayLike, fewest: ArrayLike) -> Floats:
    """Compute dynamic SPL (DSPL) for a moving goal: S a* / max(a, a*).

    Younes et al., "Catch Me If You Hear Me: Audio-Visual Navigation in Complex Unmapped
    Environments with Moving Sounds", 2022.

    Parameters
    ----------
    success : (N,) array_like
        S, 1 for success and 0 for failure.
    actions : (N,) array_like
        a, the number of actions, including rotations and Stop.
    fewest : (N,) array_like
        a*, the fewest actions of an agent that knows the walk of the goal, including rotations and
        Stop; above 0. See `avn.navigation.motion.earliest_catch`.

    Returns
    -------
    (N,) float64
    """
    return spl(success, actions, fewest)
