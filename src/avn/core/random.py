"""Random numbers that are a function of their names alone.

Starts, exploration walks and takes must stay the same for ever, whatever becomes of a library's
generators, and the draw of one episode must not depend on who else is in the batch. So they come
from a hash of what they are for: SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom
number generators", OOPSLA 2014) over a key that SHA-256 makes of the names.
"""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import ArrayLike, NDArray

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)


def derive(*names: object) -> int:
    """A 64-bit key from the names, the same on every machine."""
    text = "\x1f".join(str(name) for name in names)
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")


def scramble(key: ArrayLike, index: ArrayLike) -> NDArray[np.uint64]:
    """The `index`-th number of the stream of `key`; both broadcast against each other.

    Parameters
    ----------
    key : array_like of uint64
    index : array_like of int
        Not negative.

    Returns
    -------
    ndarray of uint64
    """
    start = np.atleast_1d(np.asarray(key, dtype=np.uint64))
    x = start + (np.atleast_1d(np.asarray(index)).astype(np.uint64) + np.uint64(1)) * _GAMMA
    x = (x ^ (x >> np.uint64(30))) * _MIX_1
    x = (x ^ (x >> np.uint64(27))) * _MIX_2
    return x ^ (x >> np.uint64(31))


def uniform(key: ArrayLike, index: ArrayLike) -> NDArray[np.float64]:
    """Numbers in [0, 1) of the streams of `key`, with 53 random bits each."""
    return (scramble(key, index) >> np.uint64(11)).astype(np.float64) * 2.0**-53
