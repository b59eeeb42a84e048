"""Lines of sight on maps of squares: what a blocked square hides.

A line between the centres of two squares is that of Bresenham ("Algorithm for computer control of
a digital plotter", IBM Systems Journal 4, 1965). At the i-th of a steps along its longer axis it is
at the step i b / a along the other one, rounded, halves down. So square (i, j) lies on the line to
(a, b) if (2 j - 1) / (2 i) < b / a <= (2 j + 1) / (2 i), with i < a.
"""

from __future__ import annotations

import numba

from avn.planning.field_state import BENT, DARK, RESTING, SIGHT, STRAIGHT, UNKNOWN, WAITING

_REST = 255 - SIGHT


@numba.njit(cache=True)
def is_clear(steps, start, square, width):  # type: ignore[no-untyped-def]
    """Return whether no square between two ones is blocked; see `field_search.repair`."""
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
def shade(square, start, blocked, reach, width, length, state, mark, heads, entries, used):  # type: ignore[no-untyped-def]
    """Note that a square hides, or hides no more, what is behind it; return the queue's length.

    Squares whose direction may change by it are put into the queue of `field_search`.
    """
    x0, y0 = start % width, start // width
    away = square % width - x0, square // width - y0
    for axis in range(2):
        major, minor = away[axis], away[1 - axis]
        i, j = abs(major), abs(minor)
        if i == 0 or j > i:
            continue
        ahead = 1 if major > 0 else -1
        origin = x0, y0
        room = width - 2 - origin[axis] if major > 0 else origin[axis] - 1
        stride, across = (1, width) if axis == 0 else (width, 1)
        for side in (-1, 1):
            if side * minor < 0:
                continue
            beside = width - 2 - origin[1 - axis] if side > 0 else origin[1 - axis] - 1
            for a in range(i + 1, min(room, reach) + 1):
                first = max((2 * j - 1) * a // (2 * i) + 1, 0)
                last = min((2 * j + 1) * a // (2 * i), a, beside)
                for b in range(first, last + 1):
                    there = start + ahead * a * stride + side * b * across
                    used = _shade_one(
                        there, blocked, reach, length, state, mark, heads, entries, used
                    )
    return used


@numba.njit(cache=True)
def _shade_one(there, blocked, reach, length, state, mark, heads, entries, used):  # type: ignore[no-untyped-def]
    own = state[there]
    sight = own & SIGHT
    if blocked:
        if sight == DARK:
            return used
        state[there] = (own & _REST) | DARK
        if own & BENT:
            return used
    else:
        if sight != DARK:
            return used
        state[there] = (own & _REST) | UNKNOWN
    now = length[there]
    if mark[there] == RESTING and now <= reach * STRAIGHT:
        mark[there] = WAITING
        entries[used, 0], entries[used, 1], heads[now] = there, heads[now], used
        used += 1
    return used
