"""Metrics of embodied navigation, and bootstrap intervals of their means.

All metrics take arrays of N episodes and return one value for each; tables show the mean.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
# Fewest clusters for an interval. In simulations, nominal 95 % intervals from the 5 sources of one
# apartment cover 85 %; with fewer, they cover still less and suggest a precision that there is not.
MIN_CLUSTERS = 5


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

    Chen et al., "Learning to Set Waypoints for Audio-Visual Navigation", 2021.

    Parameters
    ----------
    success : (N,) array_like
        S, 1 for success and 0 for failure.
    actions : (N,) array_like
        a, the number of actions, including rotations and Stop.
    fewest : (N,) array_like
        a*, the fewest actions that succeed, including rotations and Stop; above 0.

    Returns
    -------
    (N,) float64
    """
    return spl(success, actions, fewest)


def cluster_bootstrap(
    values: ArrayLike,
    clusters: ArrayLike,
    weights: ArrayLike | None = None,
    draws: int = 2000,
    level: float = 0.95,
    seed: int = 0,
) -> Floats:
    """Compute percentile intervals of weighted means by a cluster bootstrap.

    Episodes of one source in one scene are correlated, so whole clusters are drawn with
    replacement; intervals over single episodes would be too narrow (Efron and Tibshirani, "An
    Introduction to the Bootstrap", 1993, chapter 8).

    Parameters
    ----------
    values : (N, M) array_like
        M metrics of each episode, without NaN.
    clusters : (N,) array_like
        Sortable label of the cluster of each episode.
    weights : (N,) array_like, optional
        Weight of each episode; equal by default.
    draws : int
        Number of resamples.
    level : float
        Share of resamples inside the interval, 0 to 1.
    seed : int
        Seed of the resamples.

    Returns
    -------
    (2, M) float64
        Lower and upper ends; NaN with fewer than `MIN_CLUSTERS` clusters, which are too few for an
        interval.
    """
    table = np.asarray(values, dtype=np.float64)
    weight = np.ones(len(table)) if weights is None else np.asarray(weights, dtype=np.float64)
    labels, member = np.unique(np.asarray(clusters), return_inverse=True)
    if len(labels) < MIN_CLUSTERS:
        return np.full((2, table.shape[1]), np.nan)
    sums = np.zeros((len(labels), table.shape[1] + 1))
    np.add.at(sums, member.reshape(-1), np.column_stack((weight[:, None] * table, weight)))
    share = np.full(len(labels), 1.0 / len(labels))
    times = np.random.default_rng(seed).multinomial(len(labels), share, size=draws)
    drawn = times @ sums
    tail = (1.0 - level) / 2.0
    means = drawn[:, :-1] / drawn[:, -1:]
    ends: Floats = np.quantile(means, [tail, 1.0 - tail], axis=0)
    return ends
