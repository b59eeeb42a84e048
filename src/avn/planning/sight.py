"""Lines of sight on maps of squares: what a blocked square hides.

A line between the centres of two squares is that of Bresenham ("Algorithm for computer control of
a digital plotter", IBM Systems Journal 4, 1965). At the i-th of a steps along its longer axis it is
at the step i b / a along the other one, rounded, halves down. So square (i, j) lies on the line to
(a, b) if (2 j - 1) / (2 i) < b / a <= (2 j + 1) / (2 i), with i < a.
"""

from __future__ import annotations

import numba
import numpy as np

from avn.planning.field_state import DARK, SIGHT, UNKNOWN

_REST = 255 - SIGHT
# Below the difference of two different fractions b / a of squares, times a.
_ROUNDING = 1e-6


@numba.njit(cache=True)
def is_clear(steps, start, square, width):  # type: ignore[no-untyped-def]
    """Return whether no square between two ones is blocked.

    Parameters
    ----------
    steps : (2, W^2) uint8
        Units of the steps to each square, 0 if it is blocked.
    start, square : int
        Flat indices of both.
    width : int
        W.
    """
    x0, y0 = start % width, start // width
    x1, y1 = square % width, square // width
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx, sy = (1 if x1 > x0 else -1), (width if y1 > y0 else -width)
    error, here = dx - dy, start
    while True:
        twice = 2 * error
        if twice > -dy:
            error -= dy
            here += sx
        if twice < dx:
            error += dx
            here += sy
        if here == square:
            return True
        if steps[0, here] == 0:
            return False


@numba.njit(cache=True)
def shade(steps, start, reach, width, state, changes, blocked, listed, count):  # type: ignore[no-untyped-def]
    """Note what squares hide that were blocked, or hide no more as they were freed.

    Parameters
    ----------
    steps : (2, W^2) uint8
        Units of the steps to each square, 0 if it is blocked.
    start : int
        Flat index of the square from which is looked.
    reach : int
        Squares up to which is looked.
    width : int
        W.
    state : (W^2,) uint8
        States of the squares, changed in place.
    changes : (C,) int32
        See `field_search.repair`.
    blocked : bool
        Whether to look at the blocked squares or at the freed ones.
    listed : (2 W^2,) int32
        Gets the squares whose sight has changed.
    count : int
        How many there are already.

    Returns
    -------
    int
        How many there are now.
    """
    x0, y0 = start % width, start // width
    flips = np.empty((len(changes), 2), dtype=np.int64)
    number = 0
    for change in changes:
        square = change >> 1
        if change & 1 and square != start and (steps[0, square] == 0) == blocked:
            flips[number, 0], flips[number, 1] = square % width - x0, square // width - y0
            number += 1
    if number == 0:
        return count
    flips = flips[:number]
    for axis in range(2):
        own, other, stride, across = (x0, y0, 1, width) if axis == 0 else (y0, x0, width, 1)
        for ahead in (-1, 1):
            room = width - 2 - own if ahead > 0 else own - 1
            for side in (-1, 1):
                beside = width - 2 - other if side > 0 else other - 1
                limits = min(room, reach), beside
                moves = start, ahead * stride, side * across
                count = _shade_octant(
                    flips, axis, ahead, side, limits, moves, state, blocked, listed, count
                )
    return count


@numba.njit(cache=True)
def _shade_octant(  # type: ignore[no-untyped-def]
    flips, axis, ahead, side, limits, moves, state, blocked, listed, count
):
    """Shade the squares (a, b) with 0 <= b <= a, counted along and across one axis."""
    most, beside = limits
    start, along, across = moves
    # squares of the octant by i: the first of each, and the next of the same
    first, following = np.full(most + 1, -1), np.empty(len(flips), dtype=np.int64)
    found = 0
    for n in range(len(flips)):
        i, j = ahead * flips[n, axis], side * flips[n, 1 - axis]
        if 0 <= j <= i < most:
            first[i], following[n] = n, first[i]
            found += 1
    if found == 0:
        return count
    # disjoint intervals of b / a in the shade, without their lower ends
    low, high, intervals = np.empty(found), np.empty(found), 0
    for a in range(2, most + 1):
        n = first[a - 1]
        while n >= 0:
            i, j = a - 1, side * flips[n, 1 - axis]
            intervals = _unite(low, high, intervals, (2 * j - 1) / (2 * i), (2 * j + 1) / (2 * i))
            n = following[n]
        for m in range(intervals):
            begin = max(int(np.floor(low[m] * a + _ROUNDING)) + 1, 0)
            end = min(int(np.floor(high[m] * a + _ROUNDING)), a, beside)
            for b in range(begin, end + 1):
                there = start + a * along + b * across
                sight = state[there] & SIGHT
                if blocked and sight != DARK:
                    state[there] = (state[there] & _REST) | DARK
                elif not blocked and sight == DARK:
                    state[there] = (state[there] & _REST) | UNKNOWN
                else:
                    continue
                listed[count] = there
                count += 1
    return count


@numba.njit(cache=True)
def _unite(low, high, number, lowest, highest):  # type: ignore[no-untyped-def]
    """Add an interval to disjoint ones; return their number."""
    kept = 0
    for m in range(number):
        if low[m] <= highest and lowest <= high[m]:
            lowest, highest = min(low[m], lowest), max(high[m], highest)
        else:
            low[kept], high[kept] = low[m], high[m]
            kept += 1
    low[kept], high[kept] = lowest, highest
    return kept + 1
