"""Belief of N agents about the position of a source that they hear around corners."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from avn.core.actions import HEADINGS
from avn.planning.searched import Searched
from avn.planning.settings import ArrivalModel
from avn.planning.sound_fields import SQUARES, sound_fields

# Weight below which evidence is left out.
_LEAST_WEIGHT = 1e-3
_LEAST_PRECISION = 1e-6
# Length in units of `sound_fields` up to which logarithms are tabulated.
_LENGTHS = 4096
# Standard deviations at which the error of a length is cut off, so that no outlier decides.
_OUTLIER = 4.0


class ArrivalBelief(Searched):
    """Posterior of N agents over the square of the source, on M x M squares each.

    Evidence is what was heard at the last K squares at which an agent was: a distribution of the
    direction of arrival for each heading, and the length of the path of the sound. A square is
    scored by the direction and the length of the shortest path to it on the map of now, from each
    of these places. Evidence is forgotten with each square walked.

    Parameters
    ----------
    n, size : int
        N and M.
    bins : int
        Directions of arrival B, a multiple of 4.
    model : ArrivalModel
        Weights of the evidence.

    Attributes
    ----------
    log_belief : (N, M, M) float32
        Logarithm of the posterior up to a constant; -inf where the source cannot be.
    """

    def __init__(self, n: int, size: int, bins: int, model: ArrivalModel) -> None:
        super().__init__(n, size)
        self.model, self.bins, slots = model, bins, model.places
        self.log_belief = np.zeros((n, size, size), dtype=np.float32)
        # where each agent is, and the headings with which it has listened there
        self._here = np.full((n, 2), -1, dtype=np.int64)
        self._headings = np.zeros((n, HEADINGS), dtype=np.bool_)
        # a ring of places for each agent, and the newest of them
        self._newest = np.zeros(n, dtype=np.int64)
        self._position = np.full((n, slots, 2), -1, dtype=np.int64)
        self._weight = np.zeros((n, slots), dtype=np.float32)
        # sums over what was heard with each heading, and how often
        self._bearing = np.zeros((n, slots, HEADINGS, bins), dtype=np.float32)
        self._distance = np.zeros((n, slots, HEADINGS, 2), dtype=np.float32)
        self._count = np.zeros((n, slots, HEADINGS), dtype=np.float32)
        # fields of the places, and whether they are those of the present graph
        self._length = np.zeros((n, slots, size, size), dtype=np.int16)
        self._direction = np.full((n, slots, size, size), bins, dtype=np.uint8)
        self._valid = np.zeros((n, slots), dtype=np.bool_)
        self._blocked = np.zeros((n, size, size), dtype=np.bool_)

    def hear(
        self,
        pose: NDArray[np.int64],
        bearing: NDArray[np.float32],
        distance: NDArray[np.float32],
        active: NDArray[np.bool_],
        audible: NDArray[np.bool_] | None = None,
    ) -> None:
        """Add what was heard now.

        Parameters
        ----------
        pose : (N, 3) int64
            Column, row and heading of the agents.
        bearing : (N, B) float32
            Log-probability of each direction of arrival, clockwise from the agent's front.
        distance : (N, 2) float32
            Mean and standard deviation of the natural logarithm of the path's length in squares.
        active : (N,) bool
            Agents to update.
        audible : (N,) bool, optional
            Agents that heard something; all by default. The evidence of the others is not
            forgotten as they walk.
        """
        self._see(pose, active)
        rows = np.flatnonzero(active if audible is None else active & audible)
        here = self._position[rows, self._newest[rows]]
        moved = rows[(here != pose[rows, :2]).any(1)]
        self._newest[moved] = (self._newest[moved] + 1) % self.model.places
        self._weight[moved] *= self.model.kept
        place = moved, self._newest[moved]
        self._position[place], self._weight[place] = pose[moved, :2], 1.0
        self._valid[place] = False
        for own in (self._bearing, self._distance, self._count):
            own[place] = 0.0
        heading = pose[rows, 2]
        turned = (np.arange(self.bins) - heading[:, None] * (self.bins // HEADINGS)) % self.bins
        heard = rows, self._newest[rows], heading
        self._bearing[heard] += np.take_along_axis(bearing[rows], turned, 1)
        self._distance[heard] += distance[rows]
        self._count[heard] += 1

    def _see(self, pose: NDArray[np.int64], active: NDArray[np.bool_]) -> None:
        """Note where the agents are, and the headings that they had there."""
        moved = active & (self._here != pose[:, :2]).any(1)
        self._headings[moved] = False
        self._here[active] = pose[active, :2]
        self._headings[active, pose[active, 2]] = True

    def score(self, cost: NDArray[np.float32], active: NDArray[np.bool_]) -> None:
        """Compute the posterior on the graphs of now.

        The fields of earlier places are computed anew only where a square has become a node, or is
        none any more.

        Parameters
        ----------
        cost : (N, M, M) float32
            See `PartialGraph`.
        active : (N,) bool
            Agents to update.
        """
        blocked = np.isinf(cost)
        self._valid[(blocked != self._blocked).any((1, 2))] = False
        self._blocked = blocked
        kept = (self._weight > _LEAST_WEIGHT) & active[:, None]
        stale_row, stale_slot = np.nonzero(kept & ~self._valid)
        sound_fields(
            cost,
            self._position,
            stale_row,
            stale_slot,
            self.model.reach,
            self.bins,
            self._length,
            self._direction,
        )
        self._valid[stale_row, stale_slot] = True
        row, slot = np.nonzero(kept)
        bearing = np.zeros((*kept.shape, self.bins + 1), dtype=np.float32)
        log_length, precision = (np.zeros(kept.shape, dtype=np.float32) for _ in range(2))
        bearing[row, slot] = self._bearing_terms(row, slot)
        log_length[row, slot], precision[row, slot] = self._length_terms(row, slot)
        _score(
            self.log_belief,
            cost,
            self.searched,
            active,
            kept,
            self._here,
            self.model.reach,
            self.model.bias,
            (self._length, self._direction),
            (bearing, log_length, precision),
        )

    def _bearing_terms(self, row: NDArray[np.int64], slot: NDArray[np.int64]) -> NDArray[Any]:
        """Return the weighted log-probability of each direction, and of none, (R, B + 1)."""
        count, model = self._count[row, slot], self.model
        mean = self._bearing[row, slot] / np.maximum(count, 1)[..., None]
        likely = np.log((1 - model.blur) * np.exp(mean) + model.blur / self.bins)
        summed = (likely * (count > 0)[..., None]).sum(1)
        terms = model.bearing_weight * self._weight[row, slot][:, None] * summed
        # beyond the reach is less likely than the least likely direction
        return np.concatenate((terms, terms.min(1, keepdims=True) - 5), 1)

    def _length_terms(
        self, row: NDArray[np.int64], slot: NDArray[np.int64]
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return mean and weighted precision of the log-length, over the headings, (R,) each."""
        count, model = self._count[row, slot], self.model
        mean, sigma = np.moveaxis(
            self._distance[row, slot] / np.maximum(count, 1)[..., None], -1, 0
        )
        precision = (count > 0) / np.maximum(sigma, model.least_sigma) ** 2
        total = precision.sum(1)
        # the errors of the headings are not independent: their mean precision counts once
        once = total / (count > 0).sum(1)
        weight = model.distance_weight * self._weight[row, slot]
        return (mean * precision).sum(1) / total, weight * once

    def targets(
        self,
        cost: NDArray[np.float32],
        active: NDArray[np.bool_],
        offsets: NDArray[np.int64] | None = None,
    ) -> NDArray[np.int64]:
        """Return the column and row of the square that each agent walks to, (N, 2) int64.

        If all squares were searched, the search begins again.

        Parameters
        ----------
        cost : (N, M, M) float32
            See `PartialGraph`.
        active : (N,) bool
            Agents to answer for.
        offsets : (k, 2) int64, optional
            Offsets in columns and rows from a square to where the source may be for an agent to
            succeed there: the square with the greatest probability of success is returned. By
            default the likeliest square of the source.
        """
        flat = self.log_belief.reshape(len(cost), -1)
        none = active & ~np.isfinite(flat.max(1))
        if none.any():
            self.searched[none] = False
            self.score(cost, none)
        best = flat.argmax(1)
        if offsets is not None:
            rows = np.flatnonzero(active)
            best[rows] = (
                _most_around(self.log_belief[rows], offsets)
                .reshape(len(rows), flat.shape[1])
                .argmax(1)
            )
        return np.stack((best % cost.shape[1], best // cost.shape[1]), 1)

    def heard_around(self) -> NDArray[np.bool_]:
        """Return whether each agent has listened with all four headings where it is, (N,)."""
        return np.asarray(self._headings.all(1))

    def informed(self) -> NDArray[np.bool_]:
        """Return whether each agent has heard anything, (N,)."""
        return np.asarray((self._weight > _LEAST_WEIGHT).any(1))

    def near(self, position: NDArray[np.int64], offsets: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the probability that the source is at some offsets from each agent, (N,).

        Parameters
        ----------
        position : (N, 2) int64
            Column and row of the agents.
        offsets : (k, 2) int64
            Offsets in columns and rows.
        """
        flat = self.log_belief.reshape(len(position), -1)
        top = flat.max(1)
        belief = np.exp(flat - np.where(np.isfinite(top), top, 0.0)[:, None])
        size = self.log_belief.shape[1]
        squares = np.clip(position[:, None] + offsets, 0, size - 1)
        own = np.take_along_axis(belief, squares[..., 1] * size + squares[..., 0], 1)
        found: NDArray[np.float64] = own.sum(1) / np.maximum(belief.sum(1), 1e-30)
        return found


def _most_around(
    log_belief: NDArray[np.float32], offsets: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return the probability around each square, up to a factor; 0 where the source cannot be."""
    top = log_belief.max((1, 2), keepdims=True)
    belief = np.exp(log_belief - np.where(np.isfinite(top), top, 0))
    most = int(np.abs(offsets).max(initial=0))
    wide = np.pad(belief, ((0, 0), (most, most), (most, most)))
    size = log_belief.shape[1]
    total = np.zeros_like(belief)
    for column, row in offsets:
        rows, columns = (slice(most + off, most + off + size) for off in (row, column))
        total += wide[:, rows, columns]
    return np.where(belief > 0, total, np.float32(0))


@numba.njit(cache=True, parallel=True)
def _score(  # type: ignore[no-untyped-def]
    log_belief, cost, searched, active, kept, position, reach, bias, fields, terms
):
    length, direction = fields
    bearing, log_length, precision = terms
    size, slots = cost.shape[1], kept.shape[1]
    logs = np.empty(_LENGTHS, dtype=np.float32)
    logs[0] = math.log(0.5)  # of the square where the agent is
    for i in range(1, len(logs)):
        logs[i] = math.log(i * SQUARES)
    for n in numba.prange(len(cost)):
        if not active[n]:
            continue
        log_belief[n, :, :] = -np.inf
        x0, y0 = position[n, 0], position[n, 1]
        for y in range(max(y0 - reach, 0), min(y0 + reach + 1, size)):
            for x in range(max(x0 - reach, 0), min(x0 + reach + 1, size)):
                if cost[n, y, x] == np.inf or searched[n, y, x]:
                    continue
                total = np.float32(0.0)
                # sums over the places of 1, error and squared error, weighted by precision
                weight = first = second = np.float32(0.0)
                for k in range(slots):
                    if kept[n, k]:
                        units = min(int(length[n, k, y, x]), _LENGTHS - 1)
                        off = logs[units] - log_length[n, k]
                        most = (
                            _OUTLIER / math.sqrt(max(precision[n, k], _LEAST_PRECISION)) + 2 * bias
                        )
                        off = np.float32(min(max(off, -most), most))
                        weight += precision[n, k]
                        first += precision[n, k] * off
                        second += precision[n, k] * off * off
                        total += bearing[n, k, direction[n, k, y, x]]
                # Gaussian errors with a shared part, which is integrated out
                if bias > 0:
                    second -= first * first / (weight + np.float32(1.0 / (bias * bias)))
                log_belief[n, y, x] = total - np.float32(0.5) * second
