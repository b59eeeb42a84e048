"""Ways along which the paths of a field arrive: which of equally long ones a whole search finds."""

from __future__ import annotations

import numba
import numpy as np

from avn.planning.field_state import BENT, CHANGED, FROM, KNOWN, LOOKING, NOWHERE, SIGHT, WAITING

# Columns and rows from a square to its neighbours.
RIGHT = np.array([-1, 0, 1, -1, 1, -1, 0, 1])
UP = np.array([-1, -1, -1, 0, 0, 1, 1, 1])
# Neighbours to which a path goes on that came along each of the eight steps, and from the start:
# the others are nearer to the square before.
ONWARD = np.array(
    [
        [0, 1, 2, 3, 5, -1, -1, -1],
        [0, 1, 2, 3, 4, -1, -1, -1],
        [0, 1, 2, 4, 7, -1, -1, -1],
        [0, 1, 3, 5, 6, -1, -1, -1],
        [1, 2, 4, 6, 7, -1, -1, -1],
        [0, 3, 5, 6, 7, -1, -1, -1],
        [3, 4, 5, 6, 7, -1, -1, -1],
        [2, 4, 5, 6, 7, -1, -1, -1],
        [0, 1, 2, 3, 4, 5, 6, 7],
    ]
)


@numba.njit(cache=True)
def is_shut(steps, square, way, width):  # type: ignore[no-untyped-def]
    """Return whether a diagonal step to a square passes between two blocked ones.

    Parameters
    ----------
    steps : (2, W^2) uint8
        Units of the steps to each square, 0 if it is blocked.
    square : int
        Flat index of the square.
    way : int
        Step that leads there, 0 to 7.
    width : int
        W.
    """
    right, up = RIGHT[way], UP[way] * width
    if right == 0 or up == 0:
        return False
    return steps[0, square - right] == 0 and steps[0, square - up] == 0


@numba.njit(cache=True)
def choose_ways(length, state, steps, now, most, mark, entries, first, width):  # type: ignore[no-untyped-def]
    """Choose the predecessors of squares of one length where several paths are as long.

    Parameters
    ----------
    length, state : (W^2,) arrays
        Of the field; see `field_search.repair`.
    steps : (2, W^2) uint8
        Units of the steps to each square.
    now, most : int
        Length of the squares, and the greatest that is followed.
    mark : (W^2,) uint8
        Marks of the squares; see `field_state`.
    entries : (E, 2) int32
        Squares and next entries of a queue.
    first : int
        Entry of the first square.
    width : int
        W.
    """
    entry = first
    while entry >= 0:
        square, entry = entries[entry, 0], entries[entry, 1]
        if length[square] != now or mark[square] != WAITING:
            continue
        way = _way(length, state, steps, square, now, most, width)
        before = square - UP[way] * width - RIGHT[way]
        if way == state[square] & FROM and mark[before] != CHANGED:
            mark[square] = LOOKING
        else:
            mark[square], state[square] = KNOWN, (state[square] & (BENT | SIGHT)) | way


@numba.njit(cache=True)
def _way(length, state, steps, square, now, most, width):  # type: ignore[no-untyped-def]
    """Return the step by which the path arrives at a square: the first found by a whole search."""
    best, found = -1, NOWHERE
    for k in range(8):
        before = square - UP[k] * width - RIGHT[k]
        if length[before] > most:
            continue
        step = steps[int(RIGHT[k] != 0 and UP[k] != 0), square]
        if length[before] + step != now or is_shut(steps, square, k, width):
            continue
        if (
            best < 0
            or length[before] < length[best]
            or (length[before] == length[best] and _earlier(length, state, before, best, width))
        ):
            best, found = before, k
    return found


@numba.njit(cache=True)
def _earlier(length, state, one, other, width):  # type: ignore[no-untyped-def]
    """Return whether a whole search comes to a square before another one of equal length.

    A search that takes the newest entry of its queue first comes last to what it put there first:
    of two squares, to the one whose predecessor it came to first, or is the earlier neighbour of
    the same one.
    """
    flipped = False
    while True:
        a, b = state[one] & FROM, state[other] & FROM
        one -= UP[a] * width + RIGHT[a]
        other -= UP[b] * width + RIGHT[b]
        if one == other:
            return (a > b) != flipped
        if length[one] != length[other]:
            return (length[one] > length[other]) != flipped
        flipped = not flipped
