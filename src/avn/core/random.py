"""Counter-based random numbers, a pure function of the names of a stream and an index.

Start states, exploration walks and realisations must not change with versions of a library, and
the draws of one episode must not depend on the rest of the batch. So they are SplitMix64 (Steele,
Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014) over a key that is a
SHA-256 hash of the names.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_ALL = 2**64 - 1
T = TypeVar("T")


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


class Draws:
    """Stream of random numbers with the methods of a NumPy generator that apartments are drawn by.

    The n-th number is `scramble(key, n)`, in integers of Python. NumPy keeps the bits of its
    generators over versions, but not what `choice`, `integers` or `shuffle` make of them.

    Parameters
    ----------
    key : int
        Key of the stream, as of `derive`.
    """

    def __init__(self, key: int) -> None:
        self._state = key & _ALL

    def bits(self) -> int:
        """Return the next number, uniform over all 64-bit integers."""
        self._state = x = (self._state + int(_GAMMA)) & _ALL
        x = ((x ^ (x >> 30)) * int(_MIX_1)) & _ALL
        x = ((x ^ (x >> 27)) * int(_MIX_2)) & _ALL
        return x ^ (x >> 31)

    def random(self) -> float:
        """Draw a number in [0, 1), a multiple of 2 ** -53."""
        return (self.bits() >> 11) * 2.0**-53

    def uniform(self, low: float, high: float) -> float:
        """Draw a number in [low, high)."""
        return low + (high - low) * self.random()

    def integers(self, low: int, high: int | None = None) -> int:
        """Draw an integer in [0, low), or in [low, high)."""
        first, after = (0, low) if high is None else (low, high)
        return first + (self.bits() * (after - first) >> 64)

    def choice(self, values: Sequence[T]) -> T:
        """Draw one of the values."""
        return values[self.integers(len(values))]

    def permutation(self, count: int) -> list[int]:
        """Draw an order of 0, ..., count - 1."""
        order = list(range(count))
        self.shuffle(order)
        return order

    def shuffle(self, values: list[T]) -> None:
        """Shuffle a list in place (Fisher and Yates)."""
        for last in range(len(values) - 1, 0, -1):
            other = self.integers(last + 1)
            values[last], values[other] = values[other], values[last]


Rng = np.random.Generator | Draws
