"""Draw of a second source: another place, and a sound of another category."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from torch import Tensor, from_numpy

from avn.core.random import scramble


def draw_second_source(
    keys: NDArray[np.uint64],
    source: NDArray[np.int64],
    sound: NDArray[np.int64],
    sources: ArrayLike,
    categories: Sequence[str],
) -> tuple[Tensor, Tensor]:
    """Draw source and sound of a second source for each of N first ones, (N,) int64 each.

    Parameters
    ----------
    keys : (N,) uint64
        Keys of the random numbers.
    source, sound : (N,) int64
        Indices of the first sources and of their sounds.
    sources : int, or (N,) int64
        Number of sources to choose from, 2 or more.
    categories : sequence of str
        Category of each sound, of at least two kinds.
    """
    names = np.asarray(categories)
    other_category = names[:, None] != names[None, :]
    choices = np.asarray(sources).astype(np.uint64) - np.uint64(1)
    step = 1 + (scramble(keys, 0) % choices).astype(np.int64)
    # the n-th of the sounds of another category
    count = other_category.sum(1)[sound].astype(np.uint64)
    order = np.argsort(~other_category, axis=1, kind="stable")
    other = order[sound, (scramble(keys, 1) % count).astype(np.int64)]
    return from_numpy((source + step) % np.asarray(sources)), from_numpy(other)
