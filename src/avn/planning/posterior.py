"""Arithmetic of the posteriors of `ArrivalBelief`."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from avn.planning.field_state import LONGEST, STRAIGHT
from avn.planning.sound_fields import SQUARES

# Weight below which a precision is none.
_LEAST_PRECISION = 1e-6
# Length in units of `sound_fields` up to which logarithms are tabulated.
_LENGTHS = 4096
# Agents whose posteriors are taken together where a step needs copies of them.
_TOGETHER = 16
# Standard deviations at which the error of a length is cut off, so that no outlier decides.
_OUTLIER = 4.0


def parts(count: int) -> list[slice]:
    """Return slices of `_TOGETHER` of so many rows."""
    return [slice(i, i + _TOGETHER) for i in range(0, count, _TOGETHER)]


def likely(log_belief: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the probability of each square up to a factor of each agent, (R, M, M)."""
    top = log_belief.max((1, 2), keepdims=True)
    return np.exp(log_belief - np.where(np.isfinite(top), top, np.float32(0)))


@numba.njit(cache=True)
def best_around(belief, offsets):  # type: ignore[no-untyped-def]
    """Return the square with the greatest sum at some offsets, of those above 0: (R,) int64.

    The greatest value of each agent is 1, as by `likely`.
    """
    size = belief.shape[1]
    best = np.zeros(len(belief), dtype=np.int64)
    # with (0, 0) among the offsets the greatest sum is 1 or more, so one of its parts has a share
    share = np.float32(0.5 / len(offsets) if (np.abs(offsets).sum(1) == 0).any() else 0.0)
    for n in range(len(belief)):
        own, most = belief[n], np.float32(0.0)
        hot = np.zeros(size, dtype=np.bool_)
        for y in range(size):
            found = False
            for x in range(size):
                found |= own[y, x] > share
            hot[y] = found
        total = np.empty(size, dtype=np.float32)
        for y in range(size):
            near = False
            for i in range(len(offsets)):
                near |= 0 <= y + offsets[i, 1] < size and hot[y + offsets[i, 1]]
            if not near:
                continue
            total[:] = 0.0
            for i in range(len(offsets)):
                right, up = offsets[i, 0], offsets[i, 1]
                if 0 <= y + up < size:
                    for x in range(max(0, -right), min(size, size - right)):
                        total[x] += own[y + up, x + right]
            for x in range(size):
                if total[x] > most and own[y, x] > 0:
                    most, best[n] = total[x], y * size + x
    return best


@numba.njit(cache=True, parallel=True)
def score(  # type: ignore[no-untyped-def]
    log_belief, cost, searched, active, kept, position, reach, bias, fields, terms
):
    """Set `log_belief` of the active agents. See `ArrivalBelief.score`.

    `kept` is the places that count, (N, K). `fields` is `SoundFields.framed`; `terms` are the
    log-probability of each direction, of none and of what is beyond, (N, K, B + 2), and mean and
    precision of the log-length, (N, K) each.
    """
    length, direction = fields
    bearing, log_length, precision = terms
    size = cost.shape[1]
    # lengths of the fields, and one more for what was not reached
    lengths = min(reach * STRAIGHT + LONGEST + 2, _LENGTHS)
    logs = np.empty(lengths, dtype=np.float32)
    logs[0] = math.log(0.5)  # of the square where the agent is
    for i in range(1, lengths - 1):
        logs[i] = math.log(i * SQUARES)
    logs[lengths - 1] = math.log((_LENGTHS - 1) * SQUARES)
    for n in numba.prange(len(cost)):
        if not active[n]:
            continue
        log_belief[n, :, :] = -np.inf
        places = np.flatnonzero(kept[n])
        weight, errors = _tables(logs, places, log_length[n], precision[n], bias)
        shared = weight + np.float32(1.0 / (bias * bias)) if bias > 0 else np.float32(np.inf)
        total, first, second = (
            np.empty(size, dtype=np.float32),
            np.empty(size, dtype=np.float32),
            np.empty(size, dtype=np.float32),
        )
        x0, y0 = position[n, 0], position[n, 1]
        left, right = max(x0 - reach, 0), min(x0 + reach + 1, size)
        for y in range(max(y0 - reach, 0), min(y0 + reach + 1, size)):
            total[:], first[:], second[:] = 0.0, 0.0, 0.0
            for i in range(len(places)):
                k = places[i]
                _add(length[n, k, y + 1], errors[i, 1], second, left, right)
                _add(direction[n, k, y + 1], bearing[n, k], total, left, right)
                if bias > 0:
                    _add(length[n, k, y + 1], errors[i, 0], first, left, right)
            for x in range(left, right):
                if cost[n, y, x] == np.inf or searched[n, y, x]:
                    continue
                error = second[x]
                # Gaussian errors with a shared part, which is integrated out
                if bias > 0:
                    error -= first[x] * first[x] / shared
                log_belief[n, y, x] = total[x] - np.float32(0.5) * error


@numba.njit(cache=True)
def _add(framed, table, sums, left, right):  # type: ignore[no-untyped-def]
    """Add what a table has for the values of a row; the last entry is that of all above."""
    last = np.uint64(len(table) - 1)
    for x in range(left, right):
        sums[x] += table[min(np.uint64(framed[x + 1]), last)]


@numba.njit(cache=True)
def _tables(logs, places, log_length, precision, bias):  # type: ignore[no-untyped-def]
    """Return the sum of the precisions, and error and squared error of each place and length."""
    weight = np.float32(0.0)
    errors = np.empty((len(places), 2, len(logs)), dtype=np.float32)
    for i in range(len(places)):
        k = places[i]
        weight += precision[k]
        most = _OUTLIER / math.sqrt(max(precision[k], _LEAST_PRECISION)) + 2 * bias
        for units in range(len(logs)):
            off = logs[units] - log_length[k]
            off = np.float32(min(max(off, -most), most))
            errors[i, 0, units] = precision[k] * off
            errors[i, 1, units] = precision[k] * off * off
    return weight, errors
