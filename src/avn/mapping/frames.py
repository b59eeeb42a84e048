"""Alignment of two frames by votes of recognised views."""

from __future__ import annotations

import torch
from torch import Tensor

from avn.core.actions import HEADINGS
from avn.core.pose import turned


class FrameAligner:
    """Votes of N agents for the pose of their start in the frame of their exploration.

    A position p with heading h in the frame of the start has the position R(turn) p + shift and
    the heading h + turn in the frame of the exploration.

    Parameters
    ----------
    n, size : int
        Number of agents, and squares along each side of a map; shifts of more than half of it are
        ignored.
    sharpness : float
        Scale of the cosine similarity: a view with similarity s has exp((s - 1) / sharpness) votes.
    """

    def __init__(self, n: int, size: int, sharpness: float) -> None:
        self.size, self.centre, self.sharpness = size, size // 2, sharpness
        self._votes = torch.zeros(n, HEADINGS * size * size)
        self._voted = torch.zeros(n, HEADINGS * size * size, dtype=torch.bool)
        self._winner = torch.full((n,), -1)

    def vote(
        self,
        pose: Tensor,
        similarity: Tensor,
        poses: Tensor,
        confidence: float,
        rows: Tensor | None = None,
    ) -> Tensor:
        """Add the votes of the newest views; each pose votes once.

        Parameters
        ----------
        pose : (N, 3) int64 tensor
            Squares to the right, squares to the front and heading since the start.
        similarity : (N, k) float32 tensor
            Cosine similarity of the view and the retrieved entries.
        poses : (N, k, 3) int64 tensor
            Poses of the retrieved entries in the frame of the exploration.
        confidence : float
            Votes that a winner needs.
        rows : (n,) int64 tensor, optional
            Numbers of the agents whose winner is updated; all by default.

        Returns
        -------
        (N,) bool tensor
            Agents whose winner has changed.
        """
        state = self._index(pose[:, 2], pose[:, :2])[:, None]
        fresh = ~self._voted.gather(1, state)
        self._voted.scatter_(1, state, torch.ones_like(fresh))
        turn = (poses[..., 2] - pose[:, None, 2]) % HEADINGS
        k = poses.shape[1]
        moved = turned(pose[:, None, :2].expand(-1, k, -1).reshape(-1, 2), turn.reshape(-1))
        shift = poses[..., :2] - moved.view(-1, k, 2)
        inside = (shift.abs() <= self.centre).all(dim=-1) & fresh
        weight = torch.exp((similarity - 1) / self.sharpness)
        index = self._index(turn, shift.clamp(-self.centre, self.centre))
        self._votes.scatter_add_(1, index, torch.where(inside, weight, 0.0))
        return self._elect(confidence, torch.arange(len(pose)) if rows is None else rows)

    def set(self, shift: Tensor, turn: Tensor) -> None:
        """Fix the alignment at a shift (N, 2) and a turn (N,), whatever the votes."""
        self._votes.scatter_(1, self._index(turn, shift)[:, None], torch.inf)

    def reject(self, rows: Tensor) -> Tensor:
        """Exclude the winners of some agents, and return the rows that had one, (N,) bool."""
        chosen = rows & (self._winner >= 0)
        at = chosen.nonzero()[:, 0]
        self._votes[at, self._winner[at]] = -torch.inf
        self._winner[at] = -1
        return chosen

    def best(self) -> tuple[Tensor, Tensor, Tensor]:
        """Return shift (N, 2) and turn (N,) of the winners, and True if there is one, (N,) bool."""
        winner = self._winner.clamp(min=0)
        turn, square = winner // self.size**2, winner % self.size**2
        shift = torch.stack((square % self.size, square // self.size), dim=1) - self.centre
        return shift, turn, self._winner >= 0

    def _elect(self, confidence: float, rows: Tensor) -> Tensor:
        everyone = len(rows) == len(self._votes)
        most, best = (self._votes if everyone else self._votes[rows]).max(dim=1)
        winner = self._winner.clone()
        winner[rows] = torch.where(most >= confidence, best, -1)
        changed = winner != self._winner
        self._winner = winner
        return changed

    def _index(self, turn: Tensor, square: Tensor) -> Tensor:
        flat = (square[..., 1] + self.centre) * self.size + square[..., 0] + self.centre
        return turn * self.size**2 + flat


def turned_walls(walls: Tensor, turn: Tensor) -> Tensor:
    """Convert wall bits, (N, S) uint8, to a frame that is turned by quarter turns, (N,)."""
    bits = torch.arange(HEADINGS)
    there = (bits + turn[:, None]) % HEADINGS
    out = torch.zeros_like(walls)
    for heading in range(HEADINGS):
        bit = walls >> there[:, heading, None].to(torch.uint8) & 1
        out |= bit << heading
    return out
