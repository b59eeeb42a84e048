"""Search behind `sound_fields`: fields are repaired where the map has changed.

A field is a shortest-path forest in three arrays over the flat squares of a map with a margin of
one blocked square: length, direction, and a state that holds where the path comes from and what is
known of the line of sight. A change of the map invalidates the squares whose paths pass the changed
squares; they are searched again from the others, as in dynamic shortest-path forests (Ramalingam
and Reps, "An incremental algorithm for a generalization of the shortest-path problem", Journal of
Algorithms 21, 1996). Of equally long paths, the repaired field has those of a complete search,
whatever the order of the changes: see `field_ways`.
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
from avn.planning.field_ways import ONWARD, RIGHT, UP, choose_ways, is_shut
from avn.planning.sight import is_clear, shade


@numba.njit(cache=True)
def new_workspace(squares, most):  # type: ignore[no-untyped-def]
    """Return memory for searches.

    Parameters
    ----------
    squares : int
        W^2, squares of the map with its margin.
    most : int
        Greatest length up to which paths are followed.
    """
    levels = most + LONGEST + 2
    return (
        np.full(levels, -1, dtype=np.int32),  # newest entry of the queue at each length
        np.empty((10 * squares, 2), dtype=np.int32),  # entries: square, and next entry
        np.zeros(squares, dtype=np.uint8),  # marks
        np.empty(2 * squares, dtype=np.int32),  # squares: invalidated, then of another sight
        (np.arange(squares) // int(np.sqrt(squares))).astype(np.int16),  # row of each square
    )


@numba.njit(cache=True)
def repair(field, steps, start, most, bins, aims, changes, workspace):  # type: ignore[no-untyped-def]
    """Repair a field after changes of the map, in place.

    The field is right up to the length `most`, which may be less than at the last repair, but not
    more. Squares beyond have any greater length.

    Parameters
    ----------
    field : three (W^2,) arrays
        Length, int16; direction, uint8; and state, uint8: see `field_state`.
    steps : (2, W^2) uint8
        Units of a straight and of a diagonal step to each square, 0 if it is blocked.
    start : int
        Flat index of the square from which the field is seen.
    most : int
        Greatest length up to which paths are followed.
    bins : int
        See `SoundFields`.
    aims : (2 M - 1, 2 M - 1) uint8
        Direction of each offset from the start, in rows and columns.
    changes : (C,) int32
        Twice the flat index of each changed square, plus 1 if it has been blocked or freed.
    workspace : tuple of arrays
        From `new_workspace`.
    """
    length, direction, state = field
    heads, entries, mark, listed, rows = workspace
    width = int(np.sqrt(len(length)))
    mark[:] = RESTING
    count = _invalidate(
        length, direction, state, steps, start, most, bins, changes, mark, listed, width
    )
    used = 0
    if count < 0:
        length[:], direction[:] = UNREACHED, bins + 1
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
        count = shade(
            steps, start, most // STRAIGHT + 1, width, state, changes, blocked, listed, count
        )
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
    length, direction, state, steps, start, most, bins, changes, mark, listed, width
):
    """Invalidate what changed, and all paths through it; return the number, or -1 if many."""
    count, many = 0, 2 * len(length) // 3
    # what is farther is not brought within `most` by the change of its own step
    most += LONGEST
    for change in changes:
        square = change >> 1
        if not change & 1 and length[square] > most:
            continue
        if square != start and mark[square] != INVALID:
            mark[square], listed[count] = INVALID, square
            count += 1
        if change & 1:
            for k in (1, 3, 4, 6):
                there = square + UP[k] * width + RIGHT[k]
                if steps[0, there] == 0 or there == start or mark[there] == INVALID:
                    continue
                way = state[there] & FROM
                # a freed square opens diagonal steps around it, a blocked one may close them
                if steps[0, square] > 0 or (way < NOWHERE and is_shut(steps, there, way, width)):
                    mark[there], listed[count] = INVALID, there
                    count += 1
        if count > many:
            return -1
    i = 0
    while i < count:
        square = listed[i]
        length[square], direction[square] = UNREACHED, bins + 1
        state[square] = (state[square] & SIGHT) | NOWHERE
        for k in range(8):
            there = square + UP[k] * width + RIGHT[k]
            if state[there] & FROM == k and mark[there] != INVALID and length[there] <= most:
                mark[there], listed[count] = INVALID, there
                count += 1
        if count > many:
            return -1
        i += 1
    return count


@numba.njit(cache=True)
def _seed(length, steps, most, mark, invalid, heads, entries, width):  # type: ignore[no-untyped-def]
    """Put invalidated squares into the queue, with the least length from a valid neighbour."""
    used = 0
    for square in invalid:
        if steps[0, square] == 0:
            continue
        least = UNREACHED
        for k in range(8):
            before = square - UP[k] * width - RIGHT[k]
            if mark[before] != RESTING or length[before] > most:
                continue
            total = length[before] + steps[int(RIGHT[k] != 0 and UP[k] != 0), square]
            if total < least and not is_shut(steps, square, k, width):
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
        choose_ways(length, state, steps, now, most, mark, entries, first, width)
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
        way, sight, bent = old & FROM, old & SIGHT, 0
        aim = bins if square == start else bins + 1
        if now <= most and square != start:
            before = square - UP[way] * width - RIGHT[way]
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
            k = ONWARD[way, i]
            if k < 0:
                break
            there = square + UP[k] * width + RIGHT[k]
            if news == TURNED:
                total = int(length[there])
                if state[there] & FROM != k or mark[there] != RESTING or total > most:
                    continue
                mark[there] = LOOKING
            else:
                diagonal = RIGHT[k] * UP[k] != 0
                step = steps[int(diagonal), there]
                total = now + step
                if step == 0 or total > length[there]:
                    continue
                beside = square + RIGHT[k], there - RIGHT[k]
                if diagonal and steps[0, beside[0]] == 0 and steps[0, beside[1]] == 0:
                    continue
                waiting, old = mark[there], state[there] & FROM
                if total < length[there]:
                    length[there], mark[there] = total, KNOWN
                    state[there] = (state[there] & SIGHT) | k
                elif old == NOWHERE or length[there - UP[old] * width - RIGHT[old]] >= now:
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
