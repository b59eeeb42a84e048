"""Changes of maps, by which the fields of `sound_fields` are repaired: a ring for each agent."""

from __future__ import annotations

import numba
import numpy as np

from avn.planning.field_state import DIAGONAL, LONGEST, STRAIGHT


@numba.njit(cache=True)
def units(cost):  # type: ignore[no-untyped-def]
    """Return the units of a straight and of a diagonal step to a square, 0 if it is blocked."""
    if cost == np.inf:
        return 0, 0
    return (
        min(int(STRAIGHT * cost + 0.5), LONGEST),
        min(int(DIAGONAL * cost + 0.5), LONGEST),
    )


@numba.njit(cache=True, parallel=True)
def note_changes(cost, last, steps, changes, changed, active):  # type: ignore[no-untyped-def]
    """Note how maps have changed since the last time.

    Parameters
    ----------
    cost, last : (N, M, M) float32
        Costs of the squares now and then; `last` is brought up to date.
    steps : (N, 2, M + 2, M + 2) uint8
        Units of a straight and of a diagonal step to each square, brought up to date.
    changes : (N, C) int32
        Ring of changes, which gets the new ones; see `field_search.repair`.
    changed : (N,) int64
        Number of changes since the beginning, brought up to date.
    active : (N,) bool
        Agents whose maps may have changed.

    Returns
    -------
    (N,) bool
        Whether a square was blocked or freed.
    """
    size, width, remembered = cost.shape[1], cost.shape[1] + 2, changes.shape[1]
    flipped = np.zeros(len(cost), dtype=np.bool_)
    for n in numba.prange(len(cost)):
        if not active[n]:
            continue
        for y in range(size):
            differs = False
            for x in range(size):
                differs |= cost[n, y, x] != last[n, y, x]
            if not differs:
                continue
            for x in range(size):
                if cost[n, y, x] == last[n, y, x]:
                    continue
                last[n, y, x] = cost[n, y, x]
                straight, diagonal = units(cost[n, y, x])
                before = steps[n, 0, y + 1, x + 1]
                if straight == before and diagonal == steps[n, 1, y + 1, x + 1]:
                    continue
                steps[n, 0, y + 1, x + 1], steps[n, 1, y + 1, x + 1] = straight, diagonal
                flip = (straight == 0) != (before == 0)
                flipped[n] |= flip
                square = (y + 1) * width + x + 1
                changes[n, changed[n] % remembered] = 2 * square + flip
                changed[n] += 1
    return flipped


@numba.njit(cache=True)
def missed(log, n, k, listed):  # type: ignore[no-untyped-def]
    """List the changes that a field does not know.

    Parameters
    ----------
    log : tuple of (N, C) int32, (N,) int64 and (N, K) int64
        Changes and their number, as of `note_changes`, and how many each field knows; -1 for none
        of its place.
    n, k : int
        Agent and place.
    listed : (L,) int32
        Gets the changes.

    Returns
    -------
    int
        How many there are; -1 if not all of them are in the ring any more.
    """
    changes, changed, known = log
    count, remembered = changed[n] - known[n, k], changes.shape[1]
    if known[n, k] < 0 or count > remembered:
        return -1
    for j in range(count):
        listed[j] = changes[n, (known[n, k] + j) % remembered]
    return count


@numba.njit(cache=True)
def differences(steps, straight, diagonal, listed):  # type: ignore[no-untyped-def]
    """List the squares of a map whose steps are not those of a uniform one.

    If a diagonal step is as long as a straight one, paths of the uniform map may lie outside of the
    map, so all squares are listed.

    Parameters
    ----------
    steps : (2, W, W) uint8
        Units of the steps to each square.
    straight, diagonal : int
        Units of the steps of the uniform map.
    listed : (L,) int32
        Gets the squares, as changes.

    Returns
    -------
    int
        How many there are.
    """
    width, count = steps.shape[1], 0
    every = straight == diagonal and straight > 0
    for y in range(1, width - 1):
        differs = every
        for x in range(1, width - 1):
            differs |= (steps[0, y, x] != straight) | (steps[1, y, x] != diagonal)
        if not differs:
            continue
        for x in range(1, width - 1):
            if every or steps[0, y, x] != straight or steps[1, y, x] != diagonal:
                flipped = (steps[0, y, x] == 0) != (straight == 0)
                listed[count] = 2 * (y * width + x) + flipped
                count += 1
    return count
