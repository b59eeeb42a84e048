"""Counter-based random numbers, a pure function of the names of a stream and an index.

Start states, exploration walks and realisations must not change with versions of a library, and
the draws of one episode must not depend on the rest of the batch. So they are SplitMix64 (Steele,
Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014) over a key that is a
SHA-256 hash of the names.
"""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import ArrayLike, NDArray

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)


def derive(*names: object) -> int:
    """Derive a 64-bit key from names, the same on every machine."""
    text = "\x1f".join(str(name) for name in names)
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")


def scramble(key: ArrayLike, index: ArrayLike) -> NDArray[np.uint64]:
    """Return the `index`-th number of the stream of `key`; both are broadcast.

    Parameters
    ----------
    key : array_like of uint64
        Keys of `derive`.
    index : array_like of int
        Indices, 0 or more.

    Returns
    -------
    ndarray of uint64
        Uniform over all 64-bit integers.
    """
    start = np.atleast_1d(np.asarray(key, dtype=np.uint64))
    x = start + (np.atleast_1d(np.asarray(index)).astype(np.uint64) + np.uint64(1)) * _GAMMA
    x = (x ^ (x >> np.uint64(30))) * _MIX_1
    x = (x ^ (x >> np.uint64(27))) * _MIX_2
    return x ^ (x >> np.uint64(31))


def uniform(key: ArrayLike, index: ArrayLike) -> NDArray[np.float64]:
    """Return numbers in [0, 1) of the streams of `key`, with 53 random bits each."""
    return (scramble(key, index) >> np.uint64(11)).astype(np.float64) * 2.0**-53
