"""Belief of N agents about the position of a source that they hear around corners."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CELL
from avn.core.actions import HEADINGS
from avn.planning.searched import rule_out
from avn.planning.settings import ArrivalModel
from avn.planning.sound_fields import SQUARES, sound_fields


class ArrivalBelief:
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
    searched : (N, M, M) bool
        Squares that do not hold the source.
    """

    def __init__(self, n: int, size: int, bins: int, model: ArrivalModel) -> None:
        self.model, self.bins, slots = model, bins, model.places
        self.log_belief = np.zeros((n, size, size), dtype=np.float32)
        self.searched = np.zeros((n, size, size), dtype=np.bool_)
        self._position = np.full((n, slots, 2), -1, dtype=np.int64)
        self._weight = np.zeros((n, slots), dtype=np.float32)
        # sums over what was heard with each heading, and how often
        self._bearing = np.zeros((n, slots, HEADINGS, bins), dtype=np.float32)
        self._distance = np.zeros((n, slots, HEADINGS, 2), dtype=np.float32)
        self._count = np.zeros((n, slots, HEADINGS), dtype=np.float32)
        self._length = np.zeros((n, slots, size, size), dtype=np.int16)
        self._direction = np.full((n, slots, size, size), bins, dtype=np.uint8)

    def hear(
        self,
        pose: NDArray[np.int64],
        bearing: NDArray[np.float32],
        distance: NDArray[np.float32],
        active: NDArray[np.bool_],
    ) -> None:
        """Add what was heard now.

        Parameters
        ----------
        pose : (N, 3) int64
            Column, row and heading of the agents.
        bearing : (N, B) float32
            Log-probability of each direction of arrival, clockwise from the agent's front.
        distance : (N, 2) float32
            Mean and standard deviation of the natural logarithm of the path's length in metres.
        active : (N,) bool
            Agents to update.
        """
        rows = np.flatnonzero(active)
        moved = rows[(self._position[rows, 0] != pose[rows, :2]).any(1)]
        for own in (self._position, self._weight, self._bearing, self._distance, self._count):
            own[moved, 1:] = own[moved, :-1]
        self._weight[moved] *= self.model.kept
        self._position[moved, 0], self._weight[moved, 0] = pose[moved, :2], 1.0
        for own in (self._bearing, self._distance, self._count):
            own[moved, 0] = 0.0
        heading = pose[rows, 2]
        turned = (np.arange(self.bins) - heading[:, None] * (self.bins // HEADINGS)) % self.bins
        self._bearing[rows, 0, heading] += np.take_along_axis(bearing[rows], turned, 1)
        self._distance[rows, 0, heading] += distance[rows]
        self._count[rows, 0, heading] += 1

    def score(self, cost: NDArray[np.float32], active: NDArray[np.bool_]) -> None:
        """Compute the posterior on the graphs of now.

        Parameters
        ----------
        cost : (N, M, M) float32
            See `PartialGraph`.
        active : (N,) bool
            Agents to update.
        """
        model = self.model
        row, slot = np.nonzero((self._weight > 1e-3) & active[:, None])
        size = cost.shape[1]
        shape = (len(row), size, size)
        length, direction = np.empty(shape, np.int16), np.empty(shape, np.uint8)
        sound_fields(
            cost, self._position[row, slot], row, model.reach, self.bins, length, direction
        )
        count = np.maximum(self._count[row, slot], 1)
        heard = self._count[row, slot] > 0
        share = model.blur / self.bins
        mean = self._bearing[row, slot] / count[..., None]
        likely = np.log((1 - model.blur) * np.exp(mean) + share) * heard[..., None]
        bearing = np.zeros((len(row), self.bins + 1), np.float32)
        weight = self._weight[row, slot][:, None]
        bearing[:, :-1] = model.bearing_weight * weight * likely.sum(1)
        bearing[:, -1] = bearing[:, :-1].min(1) - 5
        mean_and_sigma = self._distance[row, slot] / count[..., None]
        precision = heard / np.maximum(mean_and_sigma[..., 1], model.least_sigma) ** 2
        log_length = (mean_and_sigma[..., 0] * precision).sum(1) / precision.sum(1)
        precision = model.distance_weight * weight[:, 0] * precision.sum(1) / heard.sum(1)
        begin = np.searchsorted(row, np.arange(len(cost) + 1))
        _score(
            self.log_belief,
            cost,
            self.searched,
            active,
            begin,
            length,
            direction,
            bearing,
            log_length.astype(np.float32),
            precision.astype(np.float32),
        )

    def rule_out(self, position: NDArray[np.int64], reach: int, rows: NDArray[np.bool_]) -> None:
        """Mark the squares around agents as searched. See `rule_out`."""
        rule_out(self.searched, position, reach, rows)

    def targets(self, cost: NDArray[np.float32], active: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the column and row of each agent's likeliest square, (N, 2) int64.

        If all squares were searched, the search begins again.
        """
        flat = self.log_belief.reshape(len(cost), -1)
        best = flat.argmax(1)
        none = active & ~np.isfinite(flat[np.arange(len(flat)), best])
        if none.any():
            self.searched[none] = False
            self.score(cost, none)
            best[none] = flat[none].argmax(1)
        return np.stack((best % cost.shape[1], best // cost.shape[1]), 1)

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


@numba.njit(cache=True, parallel=True, fastmath=False)
def _score(  # type: ignore[no-untyped-def]
    log_belief, cost, searched, active, begin, length, direction, bearing, log_length, precision
):
    size = cost.shape[1]
    longest = 400
    logs = np.empty(longest * 8, dtype=np.float32)
    logs[0] = math.log(0.25 * CELL)
    for i in range(1, len(logs)):
        logs[i] = math.log(i * SQUARES * CELL)
    for n in numba.prange(len(cost)):
        if not active[n]:
            continue
        for y in range(size):
            for x in range(size):
                total = np.float32(-np.inf)
                if cost[n, y, x] < np.inf and not searched[n, y, x]:
                    total = np.float32(0.0)
                    for row in range(begin[n], begin[n + 1]):
                        units = min(int(length[row, y, x]), longest * 8 - 1)
                        off = logs[units] - log_length[row]
                        # far outliers cost no more than a bound
                        gauss = min(np.float32(0.5) * off * off * precision[row], np.float32(8.0))
                        total += bearing[row, direction[row, y, x]] - gauss
                log_belief[n, y, x] = total
