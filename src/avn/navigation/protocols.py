"""Protocols: when an episode ends, what succeeds, and what a path is measured in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.apartments.floor_plan import CELL
from avn.apartments.grid import Grid, goal_cells
from avn.core.actions import STOP
from avn.core.errors import UserError

GOALS = ("box", "radius")
PATH_LENGTHS = ("moves", "metres")
MOST = 100_000  # actions, starts and steps that are still a protocol


@dataclass(frozen=True)
class Protocol:
    """The rules of an episode.

    Attributes
    ----------
    name : str
        Name of the protocol, as tables have it.
    goal : {"box", "radius"}
        Where an agent succeeds: in the 3 x 3 cells around the source that are at most 2 moves
        away from it (so that a cell behind a wall does not count), or within `radius` metres of
        the source along the shortest walk.
    radius : float
        Metres, for goal "radius".
    requires_stop : bool
        Whether Stop is an action. If so, it ends the episode, and only Stop at the goal succeeds;
        if not, arriving there does.
    path_length : {"moves", "metres"}
        What SPL measures. "moves": p is attempted moves, blocked ones too, and l the moves of
        the shortest walk to the nearest goal cell. "metres": p is metres walked and l the metres
        of the shortest walk to the source itself. Rotations count in neither.
    max_moves_ratio : float or None
        The episode ends when attempted moves reach this many times the shortest moves to the
        source cell; None for no such cap.
    max_actions : int
        The episode ends after so many actions of any kind.
    num_starts : int
        Episodes of a frozen list for each source and sound.
    exploration_steps : int
        Steps of the exploration walk, whose cells are no starts; 0 for no walk.
    """

    name: str
    goal: str
    requires_stop: bool
    path_length: str
    radius: float = 1.0
    max_moves_ratio: float | None = None
    max_actions: int = 500
    num_starts: int = 20
    exploration_steps: int = 400

    def __post_init__(self) -> None:
        for key, value, known in (
            ("goal", self.goal, GOALS),
            ("path_length", self.path_length, PATH_LENGTHS),
        ):
            if value not in known:
                raise UserError(f"protocol.{key}: '{value}' is none of {', '.join(known)}")
        for key, least in (("max_actions", 1), ("num_starts", 1), ("exploration_steps", 0)):
            if not least <= getattr(self, key) <= MOST:
                raise UserError(f"protocol.{key}: {getattr(self, key)}; give {least} to {MOST}")
        if not 0 <= self.radius <= MOST:
            raise UserError(f"protocol.radius: {self.radius}; give metres, 0 or more")
        if self.max_moves_ratio is not None and not 1 <= self.max_moves_ratio <= MOST:
            raise UserError(
                f"protocol.max_moves_ratio: {self.max_moves_ratio} is less than 1, so that no walk "
                "could arrive; give at least 1, or null for no cap"
            )

    @property
    def actions(self) -> int:
        """How many actions there are: 5 with Stop, 4 without; they are numbered from 0."""
        return STOP + 1 if self.requires_stop else STOP

    @property
    def counts_turns(self) -> bool:
        """Whether turning is paid for: where only the number of all actions ends an episode."""
        return self.max_moves_ratio is None

    def goal_cells(self, grid: Grid, sources: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Where an agent succeeds, (K, C)."""
        if self.goal == "radius":
            # A cell that is exactly 1 m away is within 1 m, whatever the rounding.
            return grid.distances[sources].astype(np.int64) * CELL <= self.radius + 1e-9
        near: NDArray[np.bool_] = goal_cells(grid)[sources]
        return near

    def judged(self, action: Tensor, arrived: Tensor) -> tuple[Tensor, Tensor]:
        """Whether an action ends the episode by itself, and whether the agent succeeds with it.

        Parameters
        ----------
        action : (N,) int64
        arrived : (N,) bool
            Whether it is at the goal after the action.

        Returns
        -------
        success, over : (N,) bool
        """
        if not self.requires_stop:
            return arrived, arrived
        stopped = action == STOP
        return arrived & stopped, stopped

    def most_moves(self, moves: Tensor) -> Tensor:
        """Attempted moves that end an episode whose shortest walk to the source has `moves`."""
        if self.max_moves_ratio is None:
            return torch.full_like(moves, self.max_actions + 1, dtype=torch.int64)
        return torch.ceil(self.max_moves_ratio * moves.double()).long()

    def out_of_time(self, actions: Tensor, attempted: Tensor, most_moves: Tensor) -> Tensor:
        """Which episodes end since actions or attempted moves have been used up, (N,) bool."""
        return (actions >= self.max_actions) | (attempted >= most_moves)
