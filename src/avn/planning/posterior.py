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


@numba.njit(cache=True, parallel=True)
def best_around(belief, offsets):  # type: ignore[no-untyped-def]
    """Return the square with the greatest sum at some offsets, of those above 0: (R,) int64."""
    size = belief.shape[1]
    best = np.zeros(len(belief), dtype=np.int64)
    for n in numba.prange(len(belief)):
        most = np.float32(0.0)
        total = np.empty(size, dtype=np.float32)
        for y in range(size):
            total[:] = 0.0
            for i in range(len(offsets)):
                right, up = offsets[i, 0], offsets[i, 1]
                if 0 <= y + up < size:
                    for x in range(max(0, -right), min(size, size - right)):
                        total[x] += belief[n, y + up, x + right]
            for x in range(size):
                if total[x] > most and belief[n, y, x] > 0:
                    most, best[n] = total[x], y * size + x
    return best


@numba.njit(cache=True, parallel=True)
def score(  # type: ignore[no-untyped-def]
    log_belief, cost, searched, active, kept, position, reach, bias, fields, terms
):
    """Set `log_belief` of the active agents. See `ArrivalBelief.score`.

    `kept` is the places that count, (N, K). `fields` is `SoundFields.framed`; `terms` are the
    log-probability of each direction, (N, K, B + 1), and mean and precision of the log-length,
    (N, K) each.
    """
    length, direction = fields
    bearing, log_length, precision = terms
    size, slots = cost.shape[1], kept.shape[1]
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
        weight, first_of, second_of = _tables(logs, kept[n], log_length[n], precision[n], bias)
        total, first, second = (
            np.empty(size, dtype=np.float32),
            np.empty(size, dtype=np.float32),
            np.empty(size, dtype=np.float32),
        )
        x0, y0 = position[n, 0], position[n, 1]
        left, right = max(x0 - reach, 0), min(x0 + reach + 1, size)
        for y in range(max(y0 - reach, 0), min(y0 + reach + 1, size)):
            total[:], first[:], second[:] = 0.0, 0.0, 0.0
            for k in range(slots):
                if not kept[n, k]:
                    continue
                for x in range(left, right):
                    units = min(int(length[n, k, y + 1, x + 1]), lengths - 1)
                    first[x] += first_of[k, units]
                    second[x] += second_of[k, units]
                    total[x] += bearing[n, k, direction[n, k, y + 1, x + 1]]
            for x in range(left, right):
                if cost[n, y, x] == np.inf or searched[n, y, x]:
                    continue
                error = second[x]
                # Gaussian errors with a shared part, which is integrated out
                if bias > 0:
                    error -= first[x] * first[x] / (weight + np.float32(1.0 / (bias * bias)))
                log_belief[n, y, x] = total[x] - np.float32(0.5) * error


@numba.njit(cache=True)
def _tables(logs, kept, log_length, precision, bias):  # type: ignore[no-untyped-def]
    """Return the sum of the precisions, and for each place and length error and squared error.

    The errors are weighted by the precision of the place.
    """
    weight = np.float32(0.0)
    first, second = (
        np.empty((len(kept), len(logs)), dtype=np.float32),
        np.empty((len(kept), len(logs)), dtype=np.float32),
    )
    for k in range(len(kept)):
        if not kept[k]:
            continue
        weight += precision[k]
        most = _OUTLIER / math.sqrt(max(precision[k], _LEAST_PRECISION)) + 2 * bias
        for units in range(len(logs)):
            off = logs[units] - log_length[k]
            off = np.float32(min(max(off, -most), most))
            first[k, units] = precision[k] * off
            second[k, units] = precision[k] * off * off
    return weight, first, second
