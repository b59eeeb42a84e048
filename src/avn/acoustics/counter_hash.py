"""Counter-based random integers: a pure function of integers, for whole batches at once.

The generator is splitmix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators",
OOPSLA 2014), used as a hash of a counter. Torch has no unsigned arithmetic of 64 bits: signed
products wrap to the same bits, and right shifts are masked to bring in zeros.
"""

from torch import Tensor

_GOLDEN = 0x9E3779B97F4A7C15 - (1 << 64)
_FIRST = 0xBF58476D1CE4E5B9 - (1 << 64)
_SECOND = 0x94D049BB133111EB - (1 << 64)
_POSITIVE = (1 << 63) - 1


def mix(counter: Tensor) -> Tensor:
    """Return the n-th output of splitmix64 from state 0.

    Parameters
    ----------
    counter : int64 tensor, any shape
        The numbers n.

    Returns
    -------
    int64 tensor, same shape
        The 64 bits of the output, as a signed number.
    """
    state = counter * _GOLDEN
    state = (state ^ ((state >> 30) & ((1 << 34) - 1))) * _FIRST
    state = (state ^ ((state >> 27) & ((1 << 37) - 1))) * _SECOND
    return state ^ ((state >> 31) & ((1 << 33) - 1))


def absorb(key: Tensor, words: Tensor) -> Tensor:
    """Hash words into a key, one after the other.

    Parameters
    ----------
    key : int64 tensor, shape (...) or ()
        Initial key.
    words : int64 tensor, shape (..., W)
        Words to hash; their order counts.

    Returns
    -------
    int64 tensor, shape (...)
    """
    for word in words.unbind(dim=-1):
        key = mix(mix(word + 1) ^ key)
    return key


def integers(key: Tensor, draw: int) -> Tensor:
    """Draw a random non-negative integer for each key.

    Parameters
    ----------
    key : int64 tensor, any shape
        Keys of `absorb`.
    draw : int
        Number of the draw: 0, 1, 2, ...

    Returns
    -------
    int64 tensor, same shape
        Uniform over 0 to 2^63 - 1.
    """
    return mix(key + draw + 1) & _POSITIVE
