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
# Logarithm of a share of the likeliest square below which a square has none.
_NOTHING = np.float32(20.0)
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


def information(log_share: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what distributions over B directions tell, in nats, (R,): log(B) less the entropy."""
    # the term of a direction that is excluded, at -inf, is 0
    terms = np.exp(log_share) * np.maximum(log_share, np.finfo(np.float32).min)
    return np.maximum(np.float32(np.log(log_share.shape[1])) + terms.sum(1), np.float32(0))


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
    log_belief, cost, searched, active, kept, position, model, around, fields, terms
):
    """Set the log-posteriors of the active agents; see `ArrivalBelief.score`.

    Parameters
    ----------
    log_belief : (N, M, M) float32
        Set to the posteriors, -inf where the source cannot be.
    cost : (N, M, M) float32
        Infinite where there is no node.
    searched : (N, M, M) bool
        Squares that do not hold the source.
    active : (N,) bool
        Agents to update.
    kept : (N, K) bool
        Places that count.
    position : (N, 2) int64
        Column and row of the agents.
    model : tuple of int and two float
        `reach`, `bias` and `tail` of `ArrivalModel`.
    around : pair of (N,) int64
        Newest place, and length of the paths from it up to which squares are scored; all are if it
        is the reach. See `SoundFields.update`.
    fields : pair of (N, K, M + 2, M + 2) arrays
        `SoundFields.framed`.
    terms : tuple of (N, K, B + 2), (N, K) and (N, K) float32
        Log-probability of each direction, of none and of what is beyond; mean and precision of the
        log-length.

    Returns
    -------
    (N,) int64
        Length of the paths from the newest place beyond which only the tail of the posterior lies;
        -1 where there is no posterior, the agent is not active, or nothing is neglected.
    """
    reach, bias, tail = model
    size, beyond = cost.shape[1], np.full(len(cost), -1, dtype=np.int64)
    logs = _logs(min(reach * STRAIGHT + LONGEST + 2, _LENGTHS))
    for n in numba.prange(len(cost)):
        if not active[n]:
            continue
        newest, most = fields[0][n, around[0][n], 1:-1, 1:-1], around[1][n]
        if most >= reach * STRAIGHT:
            most = np.iinfo(np.int16).max
        limits = np.zeros((size, 2), dtype=np.int64)
        x0, y0 = position[n, 0], position[n, 1]
        for y in range(max(y0 - reach, 0), min(y0 + reach + 1, size)):
            left, right = max(x0 - reach, 0), min(x0 + reach + 1, size)
            while left < right and newest[y, left] > most:
                left += 1
            while left < right and newest[y, right - 1] > most:
                right -= 1
            limits[y] = left, right
        own = log_belief[n]
        own[:, :] = -np.inf
        _score_agent(own, limits, n, np.flatnonzero(kept[n]), logs, bias, fields, terms)
        for y in range(size):
            for x in range(limits[y, 0], limits[y, 1]):
                if cost[n, y, x] == np.inf or searched[n, y, x] or newest[y, x] > most:
                    own[y, x] = -np.inf
        if tail > 0:
            beyond[n] = _tail_length(own, limits, newest, len(logs), tail)
    return beyond


@numba.njit(cache=True)
def _score_agent(own, limits, n, places, logs, bias, fields, terms):  # type: ignore[no-untyped-def]
    """Set the log-belief of one agent between two columns of each row."""
    length, direction = fields
    bearing, log_length, precision = terms
    weight, errors = _tables(logs, places, log_length[n], precision[n], bias)
    shared = weight + np.float32(1.0 / (bias * bias)) if bias > 0 else np.float32(np.inf)
    sums = np.empty((3, len(own)), dtype=np.float32)
    for y in range(len(own)):
        left, right = limits[y]
        if left >= right:
            continue
        sums[:, left:right] = 0.0
        for i in range(len(places)):
            k = places[i]
            part = slice(left + 1, right + 1)
            _add(
                length[n, k, y + 1, part],
                direction[n, k, y + 1, part],
                errors[i],
                bearing[n, k],
                sums[:, left:right],
            )
        for x in range(left, right):
            # Gaussian errors with a shared part, which is integrated out
            error = sums[2, x] - sums[1, x] * sums[1, x] / shared
            own[y, x] = sums[0, x] - np.float32(0.5) * error


@numba.njit(cache=True)
def _tail_length(own, limits, length, lengths, tail):  # type: ignore[no-untyped-def]
    """Return the length beyond which only a share of a posterior lies, -1 without a posterior."""
    top = np.float32(-np.inf)
    for y in range(len(own)):
        for x in range(limits[y, 0], limits[y, 1]):
            top = max(top, own[y, x])
    if top == -np.inf:
        return -1
    mass = np.zeros(lengths, dtype=np.float64)
    for y in range(len(own)):
        for x in range(limits[y, 0], limits[y, 1]):
            if own[y, x] > top - _NOTHING:
                mass[min(length[y, x], lengths - 1)] += math.exp(own[y, x] - top)
    left, found = tail * mass.sum(), lengths - 1
    while left >= mass[found]:
        left -= mass[found]
        found -= 1
    return found


@numba.njit(cache=True)
def _add(lengths, directions, errors, bearing, sums):  # type: ignore[no-untyped-def]
    """Add what tables have for a row of a field; their last entry is that of all above."""
    longest, last = np.uint64(len(errors) - 1), np.uint64(len(bearing) - 1)
    for x in range(len(lengths)):
        units = min(np.uint64(lengths[x]), longest)
        sums[0, x] += bearing[min(np.uint64(directions[x]), last)]
        sums[1, x] += errors[units, 0]
        sums[2, x] += errors[units, 1]


@numba.njit(cache=True)
def _logs(lengths):  # type: ignore[no-untyped-def]
    """Return the logarithm of each length in squares; the last one is that of all beyond."""
    logs = np.empty(lengths, dtype=np.float32)
    logs[0] = math.log(0.5)  # of the square where the agent is
    for i in range(1, lengths - 1):
        logs[i] = math.log(i * SQUARES)
    logs[lengths - 1] = math.log((_LENGTHS - 1) * SQUARES)
    return logs


@numba.njit(cache=True)
def _tables(logs, places, log_length, precision, bias):  # type: ignore[no-untyped-def]
    """Return the sum of the precisions, and error and squared error of each place and length."""
    weight = np.float32(0.0)
    errors = np.empty((len(places), len(logs), 2), dtype=np.float32)
    for i in range(len(places)):
        k = places[i]
        weight += precision[k]
        most = _OUTLIER / math.sqrt(max(precision[k], _LEAST_PRECISION)) + 2 * bias
        for units in range(len(logs)):
            off = logs[units] - log_length[k]
            off = np.float32(min(max(off, -most), most))
            errors[i, units, 0] = precision[k] * off
            errors[i, units, 1] = precision[k] * off * off
    return weight, errors
