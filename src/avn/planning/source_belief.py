"""Belief of N agents about the position of the source."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from avn.core.errors import UserError
from avn.planning.searched import Searched
from avn.planning.settings import SourceErrorModel

FILTERS = ("latest", "bayes")


class SourceBelief(Searched):
    """Belief of N agents about the position of the source, on M x M squares each.

    Parameters
    ----------
    n, size : int
        N and M.
    source_filter : {"latest", "bayes"}
        "latest" uses the newest estimate alone, as in the paper; "bayes" multiplies the
        likelihoods of all estimates.
    error : SourceErrorModel
        Error model of the estimates, for "bayes".

    Attributes
    ----------
    source_estimate : (N, 2) float64
        Newest estimate: column and row, counted from the corner of the map.

    Raises
    ------
    UserError
        If `source_filter` is unknown.
    """

    def __init__(self, n: int, size: int, source_filter: str, error: SourceErrorModel) -> None:
        if source_filter not in FILTERS:
            raise UserError(
                f"planner.source_filter: '{source_filter}' is none of {', '.join(FILTERS)}"
            )
        super().__init__(n, size)
        self.source_filter, self.error = source_filter, error
        self.source_estimate = np.full((n, 2), size // 2, dtype=np.float64)
        cells = size if source_filter == "bayes" else 0
        self._log_belief = np.zeros((n, cells, cells), dtype=np.float32)

    def update(
        self,
        position: NDArray[np.int64],
        source_estimate: NDArray[np.float64],
        mirror_image: NDArray[np.float64],
        active: NDArray[np.bool_],
    ) -> None:
        """Update the belief with the newest estimates.

        Parameters
        ----------
        position : (N, 2) int64
            Column and row of the agents.
        source_estimate, mirror_image : (N, 2) float64
            Column and row of the estimate, and of its mirror image behind the agent.
        active : (N,) bool
            Agents to update.
        """
        self.source_estimate = np.where(active[:, None], source_estimate, self.source_estimate)
        if self.source_filter == "bayes":
            e = self.error
            own = (e.sigma, e.sigma_per_metre, e.front_back_prob, e.outlier_prob, e.weight)
            _weigh(self._log_belief, position, source_estimate, mirror_image, active, own)

    def targets(self, cost: NDArray[np.float32], active: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Choose the node where each agent looks for the source next.

        It is the unsearched node nearest to the newest estimate, or the most likely one for
        "bayes". If all nodes were searched, the search begins again.

        Parameters
        ----------
        cost : (N, M, M) float32
            See `PartialGraph`.
        active : (N,) bool
            Agents to choose for.

        Returns
        -------
        (N, 2) int64
            Column and row.
        """
        if self.source_filter == "bayes":
            found, there = _likeliest(self._log_belief, cost, self.searched, active)
        else:
            found, there = _nearest(self.source_estimate, cost, self.searched, active)
        again = active & ~there
        if again.any():
            self.searched[again] = False
            found = np.where(again[:, None], np.rint(self.source_estimate).astype(np.int64), found)
        return np.clip(found, 0, cost.shape[1] - 1)


@numba.njit(cache=True, fastmath=True)
def _weigh(log_belief, position, source_estimate, mirror_image, active, error):  # type: ignore[no-untyped-def]
    sigma, sigma_per_metre, front_back_prob, outlier_prob, weight = error
    metres = 0.5
    size = log_belief.shape[1]
    for n in range(len(log_belief)):
        if not active[n]:
            continue
        ax, ay, bx, by = (
            source_estimate[n, 0],
            source_estimate[n, 1],
            mirror_image[n, 0],
            mirror_image[n, 1],
        )
        away = metres * np.sqrt((ax - position[n, 0]) ** 2 + (ay - position[n, 1]) ** 2)
        spread = (sigma + sigma_per_metre * away) / metres
        inverse = np.float32(0.5 / spread**2)
        for y in range(size):
            for x in range(size):
                d = np.float32((x - ax) ** 2 + (y - ay) ** 2) * inverse
                e = np.float32((x - bx) ** 2 + (y - by) ** 2) * inverse
                like = np.float32(outlier_prob)
                if d < 20:
                    like += np.float32(1 - front_back_prob) * np.exp(-d)
                if e < 20:
                    like += np.float32(front_back_prob) * np.exp(-e)
                log_belief[n, y, x] += np.float32(weight) * np.log(like)


@numba.njit(cache=True)
def _likeliest(log_belief, cost, searched, active):  # type: ignore[no-untyped-def]
    size = cost.shape[1]
    found = np.zeros((len(cost), 2), dtype=np.int64)
    there = np.zeros(len(cost), dtype=np.bool_)
    for n in range(len(cost)):
        best = -np.inf
        if active[n]:
            for y in range(size):
                for x in range(size):
                    value = log_belief[n, y, x]
                    if value > best and cost[n, y, x] < np.inf and not searched[n, y, x]:
                        best, there[n] = value, True
                        found[n, 0], found[n, 1] = x, y
    return found, there


@numba.njit(cache=True)
def _nearest(source_estimate, cost, searched, active):  # type: ignore[no-untyped-def]
    size = cost.shape[1]
    found = np.zeros((len(cost), 2), dtype=np.int64)
    there = np.zeros(len(cost), dtype=np.bool_)
    for n in range(len(cost)):
        if not active[n]:
            continue
        x0 = min(max(int(np.rint(source_estimate[n, 0])), 0), size - 1)
        y0 = min(max(int(np.rint(source_estimate[n, 1])), 0), size - 1)
        least = np.inf
        for ring in range(size):
            # squares of this ring and beyond are at least so far from the estimate
            if there[n] and (ring - 0.5) ** 2 > least:
                break
            for y in range(max(y0 - ring, 0), min(y0 + ring, size - 1) + 1):
                step = 1 if abs(y - y0) == ring else max(2 * ring, 1)
                for x in range(x0 - ring, x0 + ring + 1, step):
                    if 0 <= x < size and cost[n, y, x] < np.inf and not searched[n, y, x]:
                        away = (x - source_estimate[n, 0]) ** 2 + (y - source_estimate[n, 1]) ** 2
                        if away < least:
                            least, there[n] = away, True
                            found[n, 0], found[n, 1] = x, y
    return found, there
