"""Metrics of navigation as the field defines them, and how sure they are.

All take arrays of N episodes and give one value an episode; a figure of a table is their mean.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]


def spl(success: ArrayLike, path: ArrayLike, shortest: ArrayLike) -> Floats:
    """Success weighted by path length: S l / max(p, l), (N,).

    Anderson et al., "On Evaluation of Embodied Navigation Agents", 2018. `path` and `shortest`
    are in the same unit, and `shortest` is above 0.
    """
    taken, best = np.asarray(path, dtype=np.float64), np.asarray(shortest, dtype=np.float64)
    return np.asarray(success, dtype=np.float64) * best / np.maximum(taken, best)


def soft_spl(remaining: ArrayLike, path: ArrayLike, shortest: ArrayLike) -> Floats:
    """SPL with the progress made in place of success: max(0, 1 - d / l) l / max(p, l), (N,).

    Datta et al., "Integrating Egocentric Localization for More Realistic Point-Goal Navigation
    Agents", 2020. `remaining` is d, what is left of the shortest walk at the end, measured as
    `shortest` is.
    """
    progress = 1.0 - np.asarray(remaining, dtype=np.float64) / np.asarray(shortest)
    return spl(np.maximum(progress, 0.0), path, shortest)


def sna(success: ArrayLike, actions: ArrayLike, fewest: ArrayLike) -> Floats:
    """Success weighted by number of actions: S a* / max(a, a*), (N,).

    Chen et al., "Learning to Set Waypoints for Audio-Visual Navigation", 2021. `actions` counts
    every action, rotations and Stop included; `fewest` counts the turning that the first heading
    asks for and Stop where there is one.
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
    """Percentile intervals of weighted means, drawing whole clusters with replacement.

    Episodes of one source in one room share their fate, so that they are drawn together: an
    interval over single episodes would be too narrow (Efron and Tibshirani, "An Introduction to
    the Bootstrap", 1993, chapter 8).

    Parameters
    ----------
    values : (N, M) array_like
        M figures of each episode; NaN is not allowed.
    clusters : (N,) array_like
        Labels of any kind that sort.
    weights : (N,) array_like, optional
        Equal by default.
    draws : int
        Resamples.
    level : float
        Share of resamples inside the interval.
    seed : int

    Returns
    -------
    (2, M) float64
        Lower and upper ends.
    """
    table = np.asarray(values, dtype=np.float64)
    weight = np.ones(len(table)) if weights is None else np.asarray(weights, dtype=np.float64)
    labels, member = np.unique(np.asarray(clusters), return_inverse=True)
    sums = np.zeros((len(labels), table.shape[1] + 1))
    np.add.at(sums, member.reshape(-1), np.column_stack((weight[:, None] * table, weight)))
    share = np.full(len(labels), 1.0 / len(labels))
    times = np.random.default_rng(seed).multinomial(len(labels), share, size=draws)
    drawn = times @ sums
    tail = (1.0 - level) / 2.0
    means = drawn[:, :-1] / drawn[:, -1:]
    ends: Floats = np.quantile(means, [tail, 1.0 - tail], axis=0)
    return ends
