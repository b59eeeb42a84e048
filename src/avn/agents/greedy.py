"""Greedy agent, which moves towards the estimated source without regard to walls."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

from avn.agents.base import Agent
from avn.apartments.floor_plan import CELL
from avn.core.actions import FORWARD, ROTATE_LEFT, ROTATE_RIGHT, STOP
from avn.core.errors import UserError
from avn.navigation.protocols import Protocol

if TYPE_CHECKING:
    from tensordict import TensorDict


class Greedy(Agent):
    """Agent that turns towards the estimated source and moves forward.

    It uses the newest source estimate alone, and keeps no map. It moves forward if the larger
    component of the estimate points ahead, and otherwise turns a quarter towards the source.

    Parameters
    ----------
    slack : float
        Tolerance of Stop, metres, 0 to 100. Under a protocol with Stop, the agent stops if the
        estimate is at most this far beyond the outermost goal cell; the default is half a cell.
    max_rotations : int
        Quarter turns at one position after which it moves forward, 1 or more. The limit prevents
        endless turning if the estimates of different headings contradict each other.

    Raises
    ------
    UserError
        If a setting is out of range.
    """

    needs = ("source_estimate",)

    def __init__(self, slack: float = 0.25, max_rotations: int = 4) -> None:
        if not 0 <= slack <= 100:
            raise UserError(f"baseline.slack: {slack}; give metres, 0 or more")
        if max_rotations < 1:
            raise UserError(
                f"baseline.max_rotations: {max_rotations} is less than 1, so it could not turn"
            )
        self.slack = slack
        self.max_rotations = max_rotations

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes. See `Agent.reset`."""
        super().reset(n, generator, protocol)
        self.turns = torch.zeros(n, dtype=torch.int64)

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Return `slack` under a protocol without Stop. See `Agent.unused_settings`."""
        return () if protocol.requires_stop else ("slack",)

    def act(self, observation: TensorDict) -> Tensor:
        """Choose an action for every episode from the newest source estimate. See `Agent.act`."""
        right, front = observation["source_estimate"].unbind(dim=-1)
        ahead = (front > 0) & (front >= right.abs())
        forward = ahead | (self.turns >= self.max_rotations)
        self.turns = torch.where(forward, 0, self.turns + 1)
        turn = torch.where(right < 0, ROTATE_LEFT, ROTATE_RIGHT)
        actions = torch.where(forward, FORWARD, turn)
        if self.protocol.requires_stop:
            actions = torch.where(self._within_reach(right, front), STOP, actions)
        return actions

    def _within_reach(self, right: Tensor, front: Tensor) -> Tensor:
        """Return True if Stop would succeed with the source at the estimate, without walls."""
        if self.protocol.goal == "box":
            return torch.maximum(right.abs(), front.abs()) <= CELL + self.slack
        # Moves go along the axes, so the length of the path is the sum of both components.
        reach = CELL * self.protocol.most_goal_moves
        return right.abs() + front.abs() <= reach + self.slack
