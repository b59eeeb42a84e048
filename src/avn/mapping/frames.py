"""Where one frame lies in another: pictures that are recognised vote, and the winner counts."""

from __future__ import annotations

import torch
from torch import Tensor

from avn.core.actions import HEADINGS
from avn.core.pose import turned


class FrameAligner:
    """Votes of N agents for where the frame of their start lies in that of their walk.

    A place p with heading h since the start lies at R(turn) p + shift, with heading h + turn, in
    the frame of the walk.

    Parameters
    ----------
    n, size : int
        Agents, and squares along each side of a map; shifts by more than half of it are ignored.
    sharpness : float
        A picture with cosine s has the vote exp((s - 1) / sharpness).
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
        places: Tensor,
        confidence: float,
        rows: Tensor | None = None,
    ) -> Tensor:
        """Count the votes of the newest pictures; a place and heading votes once.

        Parameters
        ----------
        pose : (N, 3) int64 tensor
            Where the agents are since the start.
        similarity : (N, k) float32 tensor
        places : (N, k, 3) int64 tensor
            Where similar pictures were taken in the walk.
        confidence : float
            Votes that a winner needs.
        rows : (n,) int64 tensor, optional
            Agents whose winner is looked for, by number; all by default.

        Returns
        -------
        (N,) bool tensor
            Whose winner is now another.
        """
        state = self._index(pose[:, 2], pose[:, :2])[:, None]
        fresh = ~self._voted.gather(1, state)
        self._voted.scatter_(1, state, torch.ones_like(fresh))
        turn = (places[..., 2] - pose[:, None, 2]) % HEADINGS
        k = places.shape[1]
        moved = turned(pose[:, None, :2].expand(-1, k, -1).reshape(-1, 2), turn.reshape(-1))
        shift = places[..., :2] - moved.view(-1, k, 2)
        inside = (shift.abs() <= self.centre).all(dim=-1) & fresh
        weight = torch.exp((similarity - 1) / self.sharpness)
        index = self._index(turn, shift.clamp(-self.centre, self.centre))
        self._votes.scatter_add_(1, index, torch.where(inside, weight, 0.0))
        return self._elect(confidence, torch.arange(len(pose)) if rows is None else rows)

    def settle(self, shift: Tensor, turn: Tensor) -> None:
        """Let the frames lie where they are told to, (N, 2) and (N,), whatever is voted."""
        self._votes.scatter_(1, self._index(turn, shift)[:, None], torch.inf)

    def reject(self, rows: Tensor) -> Tensor:
        """Take the winner of some agents out for ever; gives the same rows, where they had one."""
        chosen = rows & (self._winner >= 0)
        at = chosen.nonzero()[:, 0]
        self._votes[at, self._winner[at]] = -torch.inf
        self._winner[at] = -1
        return chosen

    def best(self) -> tuple[Tensor, Tensor, Tensor]:
        """The winners' shift (N, 2) and turn (N,), and whether there is one, (N,) bool."""
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
    """Wall bits of the walk's frame, (N, S) uint8, as bits of the frame that lies turned in it."""
    bits = torch.arange(HEADINGS)
    there = (bits + turn[:, None]) % HEADINGS
    out = torch.zeros_like(walls)
    for heading in range(HEADINGS):
        bit = walls >> there[:, heading, None].to(torch.uint8) & 1
        out |= bit << heading
    return out
