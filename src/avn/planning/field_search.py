"""Search behind `sound_fields`: fields are repaired where the map has changed.

A field is a shortest-path forest in three arrays over the flat squares of a map with a margin of
one blocked square: length, direction, and a state that holds where the path comes from and what is
known of the line of sight. A change of the map invalidates the squares whose paths pass the changed
squares; they are searched again from the others, as in dynamic shortest-path forests (Ramalingam
and Reps, "An incremental algorithm for a generalization of the shortest-path problem", Journal of
Algorithms 21, 1996). Of equally long paths, the repaired field has those of a complete search,
whatever the order of the changes: see `_earlier`.
"""

from __future__ import annotations

import numba
import numpy as np

from avn.planning.field_state import (
    BENT,
    CHANGED,
    CLEAR_SIGHT,
    DARK,
    FROM,
    INVALID,
    KNOWN,
    LONGEST,
    LOOKING,
    NOWHERE,
    RESTING,
    SAME,
    SIGHT,
    STRAIGHT,
    TURNED,
    UNKNOWN,
    UNREACHED,
    WAITING,
)
from avn.planning.sight import is_clear, shade

# Columns and rows from a square to its neighbours.
_RIGHT = np.array([-1, 0, 1, -1, 1, -1, 0, 1])
_UP = np.array([-1, -1, -1, 0, 0, 1, 1, 1])
# Neighbours to which a path goes on that came along each of the eight steps, and from the start:
# the others are nearer to the square before.
_ONWARD = np.array(
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
def new_workspace(squares, reach):  # type: ignore[no-untyped-def]
    """Return memory for searches on maps of so many squares with margin."""
    levels = reach * STRAIGHT + LONGEST + 2
    return (
        np.full(levels, -1, dtype=np.int32),  # newest entry of the queue at each length
        np.empty((10 * squares, 2), dtype=np.int32),  # entries: square, and next entry
        np.zeros(squares, dtype=np.uint8),  # marks
        np.empty(2 * squares, dtype=np.int32),  # squares: invalidated, then of another sight
        (np.arange(squares) // int(np.sqrt(squares))).astype(np.int16),  # row of each square
    )


@numba.njit(cache=True)
def repair(field, steps, start, reach, bins, aims, changes, workspace):  # type: ignore[no-untyped-def]
    """Repair a field after changes of the map, in place.

    `field` is its length, direction and state, (W^2,) each. `steps` is (2, W^2) uint8: units of a
    straight and of a diagonal step to each square, 0 if blocked. `changes` has twice the flat index
    of each changed square, plus 1 if it has been blocked or freed. `aims` is the direction of
    each offset from `start`, (2 M - 1, 2 M - 1).
    """
    length, direction, state = field
    heads, entries, mark, listed, rows = workspace
    width, most = int(np.sqrt(len(length))), reach * STRAIGHT
    mark[:] = RESTING
    count = _invalidate(length, direction, state, steps, start, bins, changes, mark, listed, width)
    used = 0
    if count < 0:
        length[:], direction[:] = UNREACHED, bins
        for square in range(len(state)):
            state[square] = (state[square] & SIGHT) | NOWHERE
        mark[:] = RESTING
        length[start], mark[start] = 0, KNOWN
        entries[0, 0], entries[0, 1], heads[0] = start, -1, 0
        used = 1
    else:
        used = _seed(length, steps, most, mark, listed[:count], heads, entries, width)
    count = 0
    for blocked in (False, True):
        count = shade(steps, start, reach, width, state, changes, blocked, listed, count)
    for square in listed[:count]:
        hidden = state[square] & (BENT | SIGHT) == BENT | DARK
        if not hidden and mark[square] == RESTING and length[square] <= most:
            mark[square], now = LOOKING, length[square]
            entries[used, 0], entries[used, 1], heads[now] = square, heads[now], used
            used += 1
    _search(
        length, direction, state, steps, start, most, bins, aims, mark, heads, entries, used, rows
    )


@numba.njit(cache=True)
def _invalidate(  # type: ignore[no-untyped-def]
    length, direction, state, steps, start, bins, changes, mark, listed, width
):
    """Invalidate what changed, and all paths through it; return the number, or -1 if many."""
    count, most = 0, 2 * len(length) // 3
    for change in changes:
        square = change >> 1
        if square != start and mark[square] != INVALID:
            mark[square], listed[count] = INVALID, square
            count += 1
        if change & 1:
            for k in (1, 3, 4, 6):
                there = square + _UP[k] * width + _RIGHT[k]
                if steps[0, there] == 0 or there == start or mark[there] == INVALID:
                    continue
                way = state[there] & FROM
                # a freed square opens diagonal steps around it, a blocked one may close them
                if steps[0, square] > 0 or (way < NOWHERE and _shut(steps, there, way, width)):
                    mark[there], listed[count] = INVALID, there
                    count += 1
        if count > most:
            return -1
    i = 0
    while i < count:
        square = listed[i]
        length[square], direction[square] = UNREACHED, bins
        state[square] = (state[square] & SIGHT) | NOWHERE
        for k in range(8):
            there = square + _UP[k] * width + _RIGHT[k]
            if state[there] & FROM == k and mark[there] != INVALID:
                mark[there], listed[count] = INVALID, there
                count += 1
        if count > most:
            return -1
        i += 1
    return count


@numba.njit(cache=True)
def _shut(steps, square, way, width):  # type: ignore[no-untyped-def]
    """Return whether a diagonal step to a square passes between two blocked ones."""
    right, up = _RIGHT[way], _UP[way] * width
    if right == 0 or up == 0:
        return False
    return steps[0, square - right] == 0 and steps[0, square - up] == 0


@numba.njit(cache=True)
def _seed(length, steps, most, mark, invalid, heads, entries, width):  # type: ignore[no-untyped-def]
    """Put invalidated squares into the queue, with the least length from a valid neighbour."""
    used = 0
    for square in invalid:
        if steps[0, square] == 0:
            continue
        least = UNREACHED
        for k in range(8):
            before = square - _UP[k] * width - _RIGHT[k]
            if mark[before] != RESTING or length[before] > most:
                continue
            total = length[before] + steps[int(_RIGHT[k] != 0 and _UP[k] != 0), square]
            if total < least and not _shut(steps, square, k, width):
                least = total
        if least < UNREACHED:
            length[square], mark[square] = least, WAITING
            entries[used, 0], entries[used, 1], heads[least] = square, heads[least], used
            used += 1
    return used


@numba.njit(cache=True)
def _search(  # type: ignore[no-untyped-def]
    length, direction, state, steps, start, most, bins, aims, mark, heads, entries, used, rows
):
    """Settle the squares of the queue by length, and put there what they change."""
    width = int(np.sqrt(len(length)))
    for now in range(len(heads)):
        first, heads[now] = heads[now], -1
        if first < 0:
            continue
        _choose_ways(length, state, steps, now, most, mark, entries, first, width)
        _settle(
            length,
            direction,
            state,
            steps,
            start,
            now,
            most,
            bins,
            aims,
            mark,
            entries,
            first,
            rows,
        )
        if now <= most:
            used = _spread(
                length, state, steps, now, most, mark, heads, entries, first, used, width
            )


@numba.njit(cache=True)
def _choose_ways(length, state, steps, now, most, mark, entries, first, width):  # type: ignore[no-untyped-def]
    """Choose the predecessors of squares of one length where several paths are as long."""
    entry = first
    while entry >= 0:
        square, entry = entries[entry, 0], entries[entry, 1]
        if length[square] != now or mark[square] != WAITING:
            continue
        way = _way(length, state, steps, square, now, most, width)
        before = square - _UP[way] * width - _RIGHT[way]
        if way == state[square] & FROM and mark[before] != CHANGED:
            mark[square] = LOOKING
        else:
            mark[square], state[square] = KNOWN, (state[square] & (BENT | SIGHT)) | way


@numba.njit(cache=True)
def _settle(  # type: ignore[no-untyped-def]
    length, direction, state, steps, start, now, most, bins, aims, mark, entries, first, rows
):
    """Set state and direction of the squares of one length, and what is new of them."""
    width, y0, centre = int(np.sqrt(len(length))), rows[start], len(aims) // 2
    entry = first
    while entry >= 0:
        square, entry = entries[entry, 0], entries[entry, 1]
        waiting, old = mark[square], state[square]
        if length[square] != now or (waiting != KNOWN and waiting != LOOKING):
            continue
        way, sight, aim, bent = old & FROM, old & SIGHT, bins, 0
        if now <= most and square != start:
            before = square - _UP[way] * width - _RIGHT[way]
            bent = state[before] & BENT
            if bent == 0 and sight == UNKNOWN:
                sight = CLEAR_SIGHT if is_clear(steps, start, square, width) else DARK
            if bent != 0 or sight == DARK:
                aim, bent = direction[before], BENT
            else:
                up = rows[square] - y0
                aim = aims[up + centre, square - start - up * width + centre]
        if waiting == KNOWN:
            mark[square] = CHANGED
        elif old & BENT == bent and direction[square] == aim:
            mark[square] = SAME
        else:
            mark[square] = TURNED
        state[square], direction[square] = sight | bent | way, aim


@numba.njit(cache=True)
def _spread(length, state, steps, now, most, mark, heads, entries, first, used, width):  # type: ignore[no-untyped-def]
    """Put into the queue what squares of one length change; return the length of the queue."""
    entry = first
    while entry >= 0:
        square, entry = entries[entry, 0], entries[entry, 1]
        news, way = mark[square], state[square] & FROM
        if length[square] != now or (news != CHANGED and news != TURNED):
            continue
        for i in range(8):
            k = _ONWARD[way, i]
            if k < 0:
                break
            there = square + _UP[k] * width + _RIGHT[k]
            if news == TURNED:
                total = int(length[there])
                if state[there] & FROM != k or mark[there] != RESTING or total > most:
                    continue
                mark[there] = LOOKING
            else:
                diagonal = _RIGHT[k] * _UP[k] != 0
                step = steps[int(diagonal), there]
                total = now + step
                if step == 0 or total > length[there]:
                    continue
                beside = square + _RIGHT[k], there - _RIGHT[k]
                if diagonal and steps[0, beside[0]] == 0 and steps[0, beside[1]] == 0:
                    continue
                waiting, old = mark[there], state[there] & FROM
                if total < length[there]:
                    length[there], mark[there] = total, KNOWN
                    state[there] = (state[there] & SIGHT) | k
                elif old == NOWHERE or length[there - _UP[old] * width - _RIGHT[old]] >= now:
                    # as long as the path that is there: which one counts is known later
                    mark[there] = WAITING
                    if waiting != RESTING:
                        continue
                else:
                    # the path that is there was found before
                    continue
            entries[used, 0], entries[used, 1], heads[total] = there, heads[total], used
            used += 1
    return used


@numba.njit(cache=True)
def _way(length, state, steps, square, now, most, width):  # type: ignore[no-untyped-def]
    """Return the step by which the path arrives at a square: the first found by a whole search."""
    best, found = -1, NOWHERE
    for k in range(8):
        before = square - _UP[k] * width - _RIGHT[k]
        if length[before] > most:
            continue
        step = steps[int(_RIGHT[k] != 0 and _UP[k] != 0), square]
        if length[before] + step != now or _shut(steps, square, k, width):
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
        one -= _UP[a] * width + _RIGHT[a]
        other -= _UP[b] * width + _RIGHT[b]
        if one == other:
            return (a > b) != flipped
        if length[one] != length[other]:
            return (length[one] > length[other]) != flipped
        flipped = not flipped
