"""Occupancy maps: the probability that each square around N agents is free."""

from __future__ import annotations

import torch
from torch import Tensor

from avn.apartments.local_patch import WINDOW, window_offsets
from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.pose import turned

# Log odds of squares that were visited or collided with, which no view can change.
CERTAIN = 30.0
# Limit of the log odds that views can reach.
_MOST = 15.0
# Probabilities of a single view are clipped to this distance from 0 and 1.
_MARGIN = 1e-4


class OccupancyMap:
    """Occupancy maps of N agents on M x M squares each, with the origin in the middle.

    Every square starts at probability 0.5. A local patch updates the squares in front of the agent
    by Bayes' rule on log odds, as independent evidence (Moravec, "Sensor Fusion in Certainty Grids
    for Mobile Robots", 1989). The view of a pose never changes, so it counts once.

    Parameters
    ----------
    n : int
        Number of agents.
    size : int
        M, squares along each side, odd, 11 or more.
    prior : float or (5, 5) tensor
        Prior probability that a square of the local patch is free; its log odds are subtracted
        from those of the patch.

    Attributes
    ----------
    log_odds : (N, M, M) float32 tensor
        Log odds of being free, by square to the front and square to the right.
    walls : (N, M, M) uint8 tensor
        Bit h is set if a move along heading h between two free squares was blocked.

    Raises
    ------
    UserError
        If `size` is even or less than 11.
    """

    def __init__(self, n: int, size: int = 101, prior: float | Tensor = 0.5) -> None:
        if size < 2 * WINDOW + 1 or size % 2 == 0:
            raise UserError(f"mapper.size: {size}; give an odd number, {2 * WINDOW + 1} or more")
        self.size, self.centre = size, size // 2
        self.log_odds = torch.zeros(n, size, size)
        self.walls = torch.zeros(n, size, size, dtype=torch.uint8)
        self._seen = torch.zeros(n, size * size * HEADINGS, dtype=torch.bool)
        self._prior = torch.logit(torch.as_tensor(prior, dtype=torch.float32))
        self._offsets = torch.from_numpy(window_offsets()).long().view(1, -1, 2)

    def __len__(self) -> int:
        """Return N."""
        return len(self.log_odds)

    @property
    def belief(self) -> Tensor:
        """Probability that each square is free, (N, M, M) float32."""
        return torch.sigmoid(self.log_odds)

    @property
    def visited(self) -> Tensor:
        """Squares that the agents have visited, (N, M, M) bool."""
        return self.log_odds >= CERTAIN

    def forget(self, rows: Tensor) -> None:
        """Clear the maps of the agents with the given numbers."""
        self.log_odds[rows], self.walls[rows], self._seen[rows] = 0.0, 0, False

    def keep(self, rows: Tensor) -> None:
        """Keep the maps of the agents with the given numbers alone."""
        self.log_odds, self.walls, self._seen = (
            own[rows] for own in (self.log_odds, self.walls, self._seen)
        )

    def state_dict(self) -> dict[str, Tensor]:
        """Return the tensors of the maps, without copies."""
        return {"log_odds": self.log_odds, "walls": self.walls, "seen": self._seen}

    def load_state_dict(self, kept: dict[str, Tensor]) -> None:
        """Restore what `state_dict` returned."""
        self.log_odds, self.walls, self._seen = (
            kept[name].clone() for name in ("log_odds", "walls", "seen")
        )

    def flat(self, squares: Tensor) -> Tensor:
        """Return the flat indices of squares.

        Parameters
        ----------
        squares : (..., 2) int64 tensor
            Squares to the right and to the front of the origin.

        Returns
        -------
        (...,) int64 tensor

        Raises
        ------
        UserError
            If a square lies outside the map.
        """
        if bool((squares.abs() > self.centre).any()):
            raise UserError(f"mapper.size: an agent walked off a map of {self.size}; raise it")
        return self._index(squares)

    def integrate(self, pose: Tensor, local_patch: Tensor) -> Tensor:
        """Integrate the local patch in front of each agent.

        Parameters
        ----------
        pose : (N, 3) int64 tensor
            Squares to the right, squares to the front and heading.
        local_patch : (N, 5, 5) float tensor
            Probability that each square is free; NaN for unknown.

        Returns
        -------
        (N, 25) int64 tensor
            Flat indices of the squares that may have changed.
        """
        state = (self.flat(pose[:, :2]) * HEADINGS + pose[:, 2])[:, None]
        fresh = ~self._seen.gather(1, state)
        self._seen.scatter_(1, state, torch.ones_like(fresh))
        squares = pose[:, None, :2] + turned(self._offsets.expand(len(pose), -1, -1), pose[:, 2])
        inside = (squares.abs() <= self.centre).all(dim=-1)
        evidence = torch.logit(local_patch.float(), eps=_MARGIN) - self._prior
        evidence = torch.nan_to_num(evidence, nan=0.0).flatten(1)
        # Squares off the map become the agent's own square, which is visited and does not change.
        index = self._index(torch.where(inside[..., None], squares, pose[:, None, :2]))
        beliefs = self.log_odds.flatten(1)
        before = beliefs.gather(1, index)
        after = (before + evidence).clamp(-_MOST, _MOST)
        beliefs.scatter_(1, index, torch.where(fresh & (before.abs() < CERTAIN), after, before))
        return index

    def mark_visited(self, pose: Tensor) -> Tensor:
        """Mark the squares of the agents as free, and return their flat indices, (N,) int64."""
        index = self.flat(pose[:, :2])
        self.log_odds.flatten(1).scatter_(1, index[:, None], CERTAIN)
        return index

    def mark_collision(self, pose: Tensor, heading: Tensor, blocked: Tensor) -> Tensor:
        """Mark the squares that blocked moves led to as not free.

        If the agent has visited the square before, the edge to it is marked as a wall instead.

        Parameters
        ----------
        pose : (N, 3) int64 tensor
            Squares to the right, squares to the front and heading of the agents.
        heading : (N,) int64 tensor
            Heading of the attempted move.
        blocked : (N,) bool tensor
            True if the move was blocked.

        Returns
        -------
        (N,) int64 tensor
            Flat index of the square ahead; the agent's own if no move was blocked, or the square
            lies off the map.
        """
        here = pose[:, :2]
        ahead = here + turned(torch.tensor([[0, 1]]).expand_as(here), heading)
        known = blocked & (ahead.abs() <= self.centre).all(dim=-1)
        there = self._index(torch.where(known[:, None], ahead, here))[:, None]
        beliefs = self.log_odds.flatten(1)
        before = beliefs.gather(1, there)
        been = before >= CERTAIN
        beliefs.scatter_(1, there, torch.where(been, before, -CERTAIN))
        between, walls = (known & been[:, 0])[:, None], self.walls.flatten(1)
        for square, side in ((self._index(here)[:, None], heading), (there, heading + 2)):
            bit = torch.where(between, 1 << (side % HEADINGS)[:, None], 0).to(torch.uint8)
            walls.scatter_(1, square, walls.gather(1, square) | bit)
        return there[:, 0]

    def _index(self, squares: Tensor) -> Tensor:
        return (squares[..., 1] + self.centre) * self.size + squares[..., 0] + self.centre
