"""The occupancy map: how much each square round N agents is believed to be free."""

from __future__ import annotations

import torch
from torch import Tensor

from avn.apartments.local_patch import WINDOW, window_offsets
from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.pose import turned

# What is known beyond doubt lies at this log odds, which no picture outweighs.
CERTAIN = 30.0
# However many pictures agree, they stay below it.
_MOST = 15.0
# What a single picture says is kept off 0 and 1 by this much.
_MARGIN = 1e-4


class OccupancyMap:
    """Beliefs of N agents about M x M squares each, in a frame with its origin in the middle.

    Every square starts at 0.5. A picture changes the squares of its window by Bayes' rule, as
    independent evidence on odds (Moravec, "Sensor Fusion in Certainty Grids for Mobile Robots",
    1989). The picture of a place and heading never changes, so that it counts once.

    Parameters
    ----------
    n : int
        Agents.
    size : int
        Squares along each side, odd.
    prior : float or (5, 5) tensor
        What is believed of a square of the window before a picture is looked at; the evidence of
        a picture is its odds over these. 0.5 takes a picture's odds as they are.

    Attributes
    ----------
    log_odds : (N, M, M) float32 tensor
        By square to the front and square to the right.
    walls : (N, M, M) uint8 tensor
        Bit h is set where a move along heading h, between squares that are both free, was blocked.

    Raises
    ------
    UserError
        Where `size` is no odd number from 11.
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
        return len(self.log_odds)

    @property
    def belief(self) -> Tensor:
        """Probability that each square is free, (N, M, M) float32."""
        return torch.sigmoid(self.log_odds)

    @property
    def visited(self) -> Tensor:
        """Squares on which the agents have stood, (N, M, M) bool."""
        return self.log_odds >= CERTAIN

    def forget(self, rows: Tensor) -> None:
        """Make the maps of some agents, by number, as they were at first."""
        self.log_odds[rows], self.walls[rows], self._seen[rows] = 0.0, 0, False

    def keep(self, rows: Tensor) -> None:
        """Go on with the maps of some agents alone, by number."""
        self.log_odds, self.walls, self._seen = (
            own[rows] for own in (self.log_odds, self.walls, self._seen)
        )

    def state_dict(self) -> dict[str, Tensor]:
        """All that is believed."""
        return {"log_odds": self.log_odds, "walls": self.walls, "seen": self._seen}

    def load_state_dict(self, kept: dict[str, Tensor]) -> None:
        """Believe what `state_dict` gave."""
        self.log_odds, self.walls, self._seen = (
            kept[name].clone() for name in ("log_odds", "walls", "seen")
        )

    def flat(self, squares: Tensor) -> Tensor:
        """Where squares (right, front) from the origin lie in a map laid out flat.

        Raises
        ------
        UserError
            Where one lies outside.
        """
        if bool((squares.abs() > self.centre).any()):
            raise UserError(f"mapper.size: an agent walked off a map of {self.size}; raise it")
        return self._index(squares)

    def see(self, pose: Tensor, window: Tensor) -> Tensor:
        """Take in what pictures tell of the window in front of each agent.

        Parameters
        ----------
        pose : (N, 3) int64 tensor
            Right, front and heading.
        local_patch : (N, 5, 5) float tensor
            Probability that each square is free; NaN tells nothing.

        Returns
        -------
        (N, 25) int64 tensor
            Squares that may have changed, as `flat` counts them.
        """
        state = (self.flat(pose[:, :2]) * HEADINGS + pose[:, 2])[:, None]
        fresh = ~self._seen.gather(1, state)
        self._seen.scatter_(1, state, torch.ones_like(fresh))
        squares = pose[:, None, :2] + turned(self._offsets.expand(len(pose), -1, -1), pose[:, 2])
        inside = (squares.abs() <= self.centre).all(dim=-1)
        evidence = torch.logit(window.float(), eps=_MARGIN) - self._prior
        evidence = torch.nan_to_num(evidence, nan=0.0).flatten(1)
        # Squares off the map are moved onto its middle, where somebody stands: certain already.
        index = self._index(torch.where(inside[..., None], squares, pose[:, None, :2]))
        beliefs = self.log_odds.flatten(1)
        before = beliefs.gather(1, index)
        after = (before + evidence).clamp(-_MOST, _MOST)
        beliefs.scatter_(1, index, torch.where(fresh & (before.abs() < CERTAIN), after, before))
        return index

    def stand(self, pose: Tensor) -> Tensor:
        """Note that the squares under the agents are free; gives them, (N,) int64, flat."""
        index = self.flat(pose[:, :2])
        self.log_odds.flatten(1).scatter_(1, index[:, None], CERTAIN)
        return index

    def bump(self, pose: Tensor, heading: Tensor, blocked: Tensor) -> Tensor:
        """Note moves that were blocked: the square ahead is not free.

        Where the agent has stood on that square before, it is the way between that is blocked.

        Parameters
        ----------
        pose : (N, 3) int64 tensor
            Where the agents stand.
        heading : (N,) int64 tensor
            The way they tried to go.
        blocked : (N,) bool tensor
            Whose move was blocked.

        Returns
        -------
        (N,) int64 tensor
            The square ahead, flat; where nothing was blocked or known, the agent's own.
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
