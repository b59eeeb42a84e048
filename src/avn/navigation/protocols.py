"""Protocols: the goal, the end of an episode and the unit of path length."""

from __future__ import annotations

import math
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
CAPS = ("source", "goal")
# Changed meanings of goals, which fingerprints of products that depend on the goal cells contain:
# cells at exactly the radius were goal cells at first.
GOAL_MEANINGS = {"radius": ("nearer than the radius",)}
MOST = 100_000  # largest accepted number of actions, starts and steps
# Rounding that a product such as 0.1 * 15 is allowed.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Protocol:
    """Rules of an episode.

    Attributes
    ----------
    name : str
        Name of the protocol in tables.
    goal : {"box", "radius"}
        Goal cells: "box" is the 3 x 3 cells around the source that are at most 2 moves away from
        it, which excludes cells behind a wall; "radius" is the cells whose shortest path to the
        source is shorter than `radius`.
    radius : float
        Radius of the goal "radius", metres, more than 0. A cell at exactly the radius is no goal
        cell, as in Habitat and SoundSpaces.
    requires_stop : bool
        True if Stop is an action. Stop then ends the episode, and only Stop at the goal succeeds;
        otherwise the episode succeeds on arrival at the goal.
    path_length : {"moves", "metres"}
        Unit of path length in SPL. "moves": p is the attempted moves, including blocked ones, and
        l the moves of the shortest path to the nearest goal cell. "metres": p is the metres
        moved and l the metres of the shortest path to the source cell. Rotations do not count.
    max_moves_ratio : float or None
        Limit of the attempted moves as a multiple of the shortest moves from the start, 1 or more;
        None for no limit. `cap` says to where the moves are counted.
    max_actions : int
        Actions of any kind after which the episode ends, 1 to 100,000.
    num_starts : int
        Episodes of a frozen list for each source and sound, 1 to 100,000.
    exploration_steps : int
        Actions of the exploration trajectory, whose cells are excluded from the starts; 0 for no
        exploration.
    cap : {"source", "goal"}
        End of the shortest moves that `max_moves_ratio` multiplies: the cell of the source, or the
        nearest goal cell, as in the code that the paper's authors released.

    Raises
    ------
    UserError
        If a setting is out of range.
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
    cap: str = "source"

    def __post_init__(self) -> None:
        """Check the settings."""
        for key, value, known in (
            ("goal", self.goal, GOALS),
            ("path_length", self.path_length, PATH_LENGTHS),
            ("cap", self.cap, CAPS),
        ):
            if value not in known:
                raise UserError(f"protocol.{key}: '{value}' is none of {', '.join(known)}")
        for key, least in (("max_actions", 1), ("num_starts", 1), ("exploration_steps", 0)):
            if not least <= getattr(self, key) <= MOST:
                raise UserError(f"protocol.{key}: {getattr(self, key)}; give {least} to {MOST}")
        if not 0 < self.radius <= MOST:
            raise UserError(
                f"protocol.radius: {self.radius}; give metres, more than 0, as the goal is what is "
                "nearer than the radius"
            )
        self._check_limit()

    def _check_limit(self) -> None:
        ratio = self.max_moves_ratio
        if ratio is None:
            return
        if not 1 <= ratio <= MOST:
            raise UserError(
                f"protocol.max_moves_ratio: {ratio} is less than 1, so that no walk could arrive; "
                "give at least 1, or null for no cap"
            )
        at_source = self.cap == "goal" or (self.goal == "radius" and self.most_goal_moves == 0)
        if self.requires_stop and ratio == 1 and at_source:
            raise UserError(
                f"protocol.max_moves_ratio: {ratio}, so that an episode ends on arrival and no "
                "agent could stop there; give more than 1"
            )

    @property
    def actions(self) -> int:
        """Number of actions, 5 with Stop and 4 without; they are numbered from 0."""
        return STOP + 1 if self.requires_stop else STOP

    @property
    def counts_turns(self) -> bool:
        """True if rotations count towards the limit, as without a limit of attempted moves."""
        return self.max_moves_ratio is None

    @property
    def most_goal_moves(self) -> int:
        """Moves from the source to the farthest cells of the goal "radius"."""
        return math.ceil((self.radius - _ROUNDING) / CELL) - 1

    def goal_cells(self, grid: Grid, sources: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Return the cells in which an agent succeeds, (K, C) bool."""
        if self.goal == "radius":
            return grid.distances[sources].astype(np.int64) <= self.most_goal_moves
        near: NDArray[np.bool_] = goal_cells(grid)[sources]
        return near

    def judge(self, action: Tensor, arrived: Tensor) -> tuple[Tensor, Tensor]:
        """Judge the actions of N agents.

        Parameters
        ----------
        action : (N,) int64
            See `avn.core.actions`.
        arrived : (N,) bool
            True if the agent is at the goal after the action.

        Returns
        -------
        success, over : (N,) bool
            Episodes that succeed with the action, and episodes that end with it.
        """
        if not self.requires_stop:
            return arrived, arrived
        stopped = action == STOP
        return arrived & stopped, stopped

    def most_moves(self, moves: Tensor) -> Tensor:
        """Return the limit of attempted moves for shortest paths of `moves` moves, int64.

        The moves are those to the cell that `cap` names; the limit has the shape of `moves`.
        """
        if self.max_moves_ratio is None:
            return torch.full_like(moves, self.max_actions + 1, dtype=torch.int64)
        return torch.ceil(self.max_moves_ratio * moves.double() - _ROUNDING).long()

    def out_of_time(self, actions: Tensor, attempted: Tensor, most_moves: Tensor) -> Tensor:
        """Return the episodes that have reached a limit.

        Parameters
        ----------
        actions, attempted : (N,) int64
            Actions and attempted moves so far.
        most_moves : (N,) int64
            Limit of attempted moves; see `most_moves`.

        Returns
        -------
        (N,) bool
        """
        return (actions >= self.max_actions) | (attempted >= most_moves)
