"""Belief of N agents about the position of a source that they hear around corners."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from avn.core.actions import HEADINGS
from avn.planning.field_state import STRAIGHT
from avn.planning.posterior import best_around, information, likely, parts, score
from avn.planning.searched import Searched
from avn.planning.settings import ArrivalModel
from avn.planning.sound_fields import SoundFields

# Weight below which evidence is left out.
_LEAST_WEIGHT = 1e-3


class ArrivalBelief(Searched):
    """Posterior of N agents over the square of the source, on M x M squares each.

    Evidence is what was heard at the last K squares at which an agent was: a distribution of the
    direction of arrival for each heading, and the length of the path of the sound. A square is
    scored by the direction and the length of the shortest path to it on the map of now, from each
    of these places. Evidence is forgotten as the agent walks; see `ArrivalModel.forget_by`.

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
        # log-probability of each direction, summed over the headings
        self._direction = np.zeros((n, slots, bins), dtype=np.float32)
        self._fields = SoundFields(n, slots, size, model.reach, bins)
        # length of the paths from the newest place that are followed
        self._followed = np.full(n, model.reach * STRAIGHT, dtype=np.int64)

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
        by_square = self.model.forget_by == "square"
        told = np.float32(1) if by_square else information(bearing[moved])[:, None]
        self._weight[moved] *= np.float32(self.model.kept) ** told
        place = moved, self._newest[moved]
        self._position[place], self._weight[place] = pose[moved, :2], 1.0
        self._fields.forget(*place)
        for own in (self._bearing, self._distance, self._count):
            own[place] = 0.0
        heading = pose[rows, 2]
        turned = (np.arange(self.bins) - heading[:, None] * (self.bins // HEADINGS)) % self.bins
        heard = rows, self._newest[rows], heading
        self._bearing[heard] += np.take_along_axis(bearing[rows], turned, 1)
        self._distance[heard] += distance[rows]
        self._count[heard] += 1
        self._direction[heard[:2]] = self._directions(*heard[:2])

    def _see(self, pose: NDArray[np.int64], active: NDArray[np.bool_]) -> None:
        """Note where the agents are, and the headings that they had there."""
        moved = active & (self._here != pose[:, :2]).any(1)
        self._headings[moved] = False
        self._here[active] = pose[active, :2]
        self._headings[active, pose[active, 2]] = True

    def score(
        self,
        cost: NDArray[np.float32],
        active: NDArray[np.bool_],
        sound_cost: NDArray[np.float32] | None = None,
    ) -> None:
        """Compute the posterior on the graphs of now.

        The fields of earlier places are repaired only where a square has become a node, or is none
        any more.

        Parameters
        ----------
        cost : (N, M, M) float32
            See `PartialGraph`.
        active : (N,) bool
            Agents to update.
        sound_cost : (N, M, M) float32, optional
            Costs of the squares for sound; `cost` by default.
        """
        heard_through = cost if sound_cost is None else sound_cost
        length = self._score(cost, active, heard_through)
        if self.model.tail == 0:
            return
        most = self.model.reach * STRAIGHT
        lost = active & (length < 0) & (self._followed < most)
        if lost.any():
            # nothing is left of what was followed
            self._followed[lost] = most
            length = np.where(lost, self._score(cost, lost, heard_through), length)
        # twice as far where the posterior ends where it was cut off
        cut = length >= self._followed - STRAIGHT
        farther = np.where(cut, 2 * self._followed, length + length // 4) + 3 * STRAIGHT
        wanted = np.where(length < 0, most, np.maximum(farther, self._followed // 2))
        self._followed[active] = np.minimum(wanted, most)[active]

    def _score(
        self,
        cost: NDArray[np.float32],
        active: NDArray[np.bool_],
        sound_cost: NDArray[np.float32],
    ) -> NDArray[np.int64]:
        """Compute the posterior where paths are followed; see `posterior.score`."""
        kept = (self._weight > _LEAST_WEIGHT) & active[:, None]
        around = self._newest, self._followed
        self._fields.update(sound_cost, self._position, kept, active, around)
        row, slot = np.nonzero(kept)
        bearing = np.zeros((*kept.shape, self.bins + 2), dtype=np.float32)
        log_length, precision = (np.zeros(kept.shape, dtype=np.float32) for _ in range(2))
        bearing[row, slot] = self._bearing_terms(row, slot)
        log_length[row, slot], precision[row, slot] = self._length_terms(row, slot)
        beyond = score(
            self.log_belief,
            cost,
            self.searched,
            active,
            kept,
            self._here,
            (self.model.reach, self.model.bias, self.model.tail),
            around,
            self._fields.framed,
            (bearing, log_length, precision),
        )
        return np.asarray(beyond)

    def _directions(self, row: NDArray[np.int64], slot: NDArray[np.int64]) -> NDArray[Any]:
        """Return the log-probability of each direction, summed over the headings, (R, B)."""
        count, blur = self._count[row, slot], self.model.blur
        mean = self._bearing[row, slot] / np.maximum(count, 1)[..., None]
        terms = np.log((1 - blur) * np.exp(mean) + blur / self.bins)
        return (terms * (count > 0)[..., None]).sum(1)

    def _bearing_terms(self, row: NDArray[np.int64], slot: NDArray[np.int64]) -> NDArray[Any]:
        """Return the weighted log-probability of each direction, of none, and beyond, (R, B + 2).

        A source where it is heard has no direction: all are as likely.
        """
        model = self.model
        headings = (self._count[row, slot] > 0).sum(1).astype(np.float32)
        part = headings ** -np.float32(model.shared_by_headings or 0.0)
        weight = (model.bearing_weight * part * self._weight[row, slot])[:, None]
        terms = weight * self._direction[row, slot]
        none = weight * headings[:, None] * -np.float32(np.log(self.bins))
        # beyond the reach is less likely than the least likely direction
        return np.concatenate((terms, none, terms.min(1, keepdims=True) - 5), 1)

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
        sound_cost: NDArray[np.float32] | None = None,
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
        sound_cost : (N, M, M) float32, optional
            See `score`.
        """
        best = np.zeros(len(cost), dtype=np.int64)
        rows = np.flatnonzero(active)
        best[rows], there = self._best(rows, offsets)
        if not there.all():
            again = rows[~there]
            self.searched[again] = False
            none = np.zeros_like(active)
            none[again] = True
            self.score(cost, none, sound_cost)
            best[again], _ = self._best(again, offsets)
        return np.stack((best % cost.shape[1], best // cost.shape[1]), 1)

    def _best(
        self, rows: NDArray[np.int64], offsets: NDArray[np.int64] | None
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the flat index of the best square, and whether there is any, (R,) each."""
        best, there = np.zeros(len(rows), dtype=np.int64), np.zeros(len(rows), dtype=np.bool_)
        for part in parts(len(rows)):
            own = self.log_belief[rows[part]]
            flat = own.reshape(len(own), -1)
            there[part] = np.isfinite(flat.max(1))
            best[part] = flat.argmax(1) if offsets is None else best_around(likely(own), offsets)
        return best, there

    def heard_around(self) -> NDArray[np.bool_]:
        """Return whether each agent has listened with all four headings where it is, (N,)."""
        return np.asarray(self._headings.all(1))

    def informed(self) -> NDArray[np.bool_]:
        """Return whether each agent has heard anything, (N,)."""
        return np.asarray((self._weight > _LEAST_WEIGHT).any(1))

    def near(
        self,
        position: NDArray[np.int64],
        offsets: NDArray[np.int64],
        active: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]:
        """Return the probability that the source is at some offsets from each agent, (N,).

        Parameters
        ----------
        position : (N, 2) int64
            Column and row of the agents.
        offsets : (k, 2) int64
            Offsets in columns and rows.
        active : (N,) bool, optional
            Agents to answer for, all by default; 0 for the others.
        """
        found = np.zeros(len(position), dtype=np.float64)
        rows = np.arange(len(position)) if active is None else np.flatnonzero(active)
        size = self.log_belief.shape[1]
        squares = np.clip(position[:, None] + offsets, 0, size - 1)
        index = squares[..., 1] * size + squares[..., 0]
        for part in parts(len(rows)):
            own = rows[part]
            belief = likely(self.log_belief[own]).reshape(len(own), -1)
            nearby = np.take_along_axis(belief, index[own], 1).sum(1)
            found[own] = nearby / np.maximum(belief.sum(1), 1e-30)
        return found
