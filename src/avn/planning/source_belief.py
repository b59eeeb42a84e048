"""Where N agents look for the source: what they heard, and where they were in vain."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from avn.core.errors import UserError

FILTERS = ("latest", "bayes")


@dataclass
class SourceErrorModel:
    """How far an estimate of the sound network is trusted, for `source_filter=bayes`.

    An estimate r metres away stands for a normal distribution with the standard deviation
    `sigma` + `sigma_per_metre` r. A part `front_back_prob` of the weight lies on its mirror image
    behind the agent, for ears confuse front and back, and `outlier_prob` lies anywhere.

    Attributes
    ----------
    sigma : float
        Metres of the standard deviation that do not depend on the distance.
    sigma_per_metre : float
        Part of the distance that is added to the standard deviation.
    front_back_prob : float
        Part of the weight that lies on the mirror image behind the agent.
    outlier_prob : float
        Part of the weight that lies anywhere.
    weight : float
        What one estimate counts; less than 1, since the errors of one place repeat.
    """

    sigma: float = 0.5
    sigma_per_metre: float = 0.25
    front_back_prob: float = 0.1
    outlier_prob: float = 0.02
    weight: float = 0.5

    def __post_init__(self) -> None:
        for key in ("sigma", "sigma_per_metre", "front_back_prob", "outlier_prob", "weight"):
            if not 0 <= getattr(self, key) <= 100:
                raise UserError(f"planner.error.{key}: {getattr(self, key)}; give 0 to 100")
        if self.sigma == 0 or self.outlier_prob == 0 or self.front_back_prob >= 1:
            raise UserError(
                "planner.error: sigma and outlier_prob are over 0, and front_back_prob is under 1"
            )


class SourceBelief:
    """What N agents believe about the place of the source, on M x M squares each.

    Parameters
    ----------
    n, size : int
    source_filter : {"latest", "bayes"}
        The newest estimate alone, as in the paper, or the product of all of them.
    error : HearingError
        For "bayes".

    Attributes
    ----------
    aim : (N, 2) float64
        Where the source is taken to be: column and row, counted from the map's corner.
    searched : (N, M, M) bool
        Squares where the source is not.
    """

    def __init__(self, n: int, size: int, source_filter: str, error: SourceErrorModel) -> None:
        if source_filter not in FILTERS:
            raise UserError(
                f"planner.source_filter: '{source_filter}' is none of {', '.join(FILTERS)}"
            )
        self.source_filter, self.error = source_filter, error
        self.aim = np.full((n, 2), size // 2, dtype=np.float64)
        self.searched = np.zeros((n, size, size), dtype=np.bool_)
        cells = size if source_filter == "bayes" else 0
        self._log_belief = np.zeros((n, cells, cells), dtype=np.float32)

    def listen(
        self,
        place: NDArray[np.int64],
        aim: NDArray[np.float64],
        mirrored: NDArray[np.float64],
        running: NDArray[np.bool_],
    ) -> None:
        """Take in the newest estimates.

        Parameters
        ----------
        place : (N, 2) int64
            Column and row where the agents stand.
        aim, mirrored : (N, 2) float64
            The estimate, and its mirror image behind the agent, as column and row.
        running : (N,) bool
            Who listens.
        """
        self.aim = np.where(running[:, None], aim, self.aim)
        if self.source_filter == "bayes":
            e = self.error
            own = (e.sigma, e.sigma_per_metre, e.front_back_prob, e.outlier_prob, e.weight)
            _weigh(self._log_belief, place, aim, mirrored, running, own)

    def rule_out(self, place: NDArray[np.int64], reach: int, rows: NDArray[np.bool_]) -> None:
        """Note that the source is not within `reach` squares of agents, diagonals included."""
        chosen = np.flatnonzero(rows)
        size = self.searched.shape[1]
        around = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), -1).reshape(-1, 2)
        squares = np.clip(place[chosen, None] + around, 0, size - 1)
        self.searched[chosen[:, None], squares[..., 1], squares[..., 0]] = True

    def targets(self, cost: NDArray[np.float32], running: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The node where each agent now looks for the source, (N, 2) column and row.

        Of the nodes that were not searched, the one nearest to the newest estimate, or the one
        believed most. Where all were searched, the search begins anew.
        """
        if self.source_filter == "bayes":
            found, there = _likeliest(self._log_belief, cost, self.searched, running)
        else:
            found, there = _nearest(self.aim, cost, self.searched, running)
        again = running & ~there
        if again.any():
            self.searched[again] = False
            found = np.where(again[:, None], np.rint(self.aim).astype(np.int64), found)
        return np.clip(found, 0, cost.shape[1] - 1)


@numba.njit(cache=True, fastmath=True)
def _weigh(log_belief, place, aim, mirrored, running, error):  # type: ignore[no-untyped-def]
    sigma, sigma_per_metre, front_back_prob, outlier_prob, weight = error
    metres = 0.5
    size = log_belief.shape[1]
    for n in range(len(log_belief)):
        if not running[n]:
            continue
        ax, ay, bx, by = aim[n, 0], aim[n, 1], mirrored[n, 0], mirrored[n, 1]
        away = metres * np.sqrt((ax - place[n, 0]) ** 2 + (ay - place[n, 1]) ** 2)
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
def _likeliest(log_belief, cost, searched, running):  # type: ignore[no-untyped-def]
    size = cost.shape[1]
    found = np.zeros((len(cost), 2), dtype=np.int64)
    there = np.zeros(len(cost), dtype=np.bool_)
    for n in range(len(cost)):
        best = -np.inf
        if running[n]:
            for y in range(size):
                for x in range(size):
                    value = log_belief[n, y, x]
                    if value > best and cost[n, y, x] < np.inf and not searched[n, y, x]:
                        best, there[n] = value, True
                        found[n, 0], found[n, 1] = x, y
    return found, there


@numba.njit(cache=True)
def _nearest(aim, cost, searched, running):  # type: ignore[no-untyped-def]
    size = cost.shape[1]
    found = np.zeros((len(cost), 2), dtype=np.int64)
    there = np.zeros(len(cost), dtype=np.bool_)
    for n in range(len(cost)):
        if not running[n]:
            continue
        x0 = min(max(int(np.rint(aim[n, 0])), 0), size - 1)
        y0 = min(max(int(np.rint(aim[n, 1])), 0), size - 1)
        least = np.inf
        for ring in range(size):
            # squares of this ring and beyond are at least so far from the aim
            if there[n] and (ring - 0.5) ** 2 > least:
                break
            for y in range(max(y0 - ring, 0), min(y0 + ring, size - 1) + 1):
                step = 1 if abs(y - y0) == ring else max(2 * ring, 1)
                for x in range(x0 - ring, x0 + ring + 1, step):
                    if 0 <= x < size and cost[n, y, x] < np.inf and not searched[n, y, x]:
                        away = (x - aim[n, 0]) ** 2 + (y - aim[n, 1]) ** 2
                        if away < least:
                            least, there[n] = away, True
                            found[n, 0], found[n, 1] = x, y
    return found, there
