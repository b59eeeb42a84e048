"""Greedy search: walk towards where the source is heard, blind to walls."""

from __future__ import annotations

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent
from avn.apartments.floor_plan import CELL
from avn.core.actions import FORWARD, ROTATE_LEFT, ROTATE_RIGHT, STOP
from avn.core.errors import UserError
from avn.navigation.protocols import Protocol


class Greedy(Agent):
    """Turns to the axis with the larger part of the heard location, and walks.

    It listens anew after every action and knows neither walls nor where it has been. Where
    the source is heard ahead it walks; else it turns a quarter to the side where it is heard.

    Parameters
    ----------
    slack : float
        Metres. Where the protocol has Stop, it says so as soon as the source is heard at most that
        far beyond where Stop succeeds; half a cell by default, since what is heard lies on no grid.
    max_rotations : int
        Quarter turns in one place, after which it walks straight on: what is heard facing one way
        may contradict what is heard facing another, and it would turn for ever.
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
        """Begin N new episodes."""
        super().reset(n, generator, protocol)
        self.turns = torch.zeros(n, dtype=torch.int64)

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Where nobody says Stop, how far beyond the goal it would."""
        return () if protocol.requires_stop else ("slack",)

    def act(self, observation: TensorDict) -> Tensor:
        """One action for every episode, from the location heard now."""
        right, front = observation["source_estimate"].unbind(dim=-1)
        ahead = (front > 0) & (front >= right.abs())
        walks = ahead | (self.turns >= self.max_rotations)
        self.turns = torch.where(walks, 0, self.turns + 1)
        turn = torch.where(right < 0, ROTATE_LEFT, ROTATE_RIGHT)
        actions = torch.where(walks, FORWARD, turn)
        if self.protocol.requires_stop:
            actions = torch.where(self._within_reach(right, front), STOP, actions)
        return actions

    def _within_reach(self, right: Tensor, front: Tensor) -> Tensor:
        """Whether Stop would succeed if the source were where it is heard and no wall near."""
        if self.protocol.goal == "box":
            return torch.maximum(right.abs(), front.abs()) <= CELL + self.slack
        # Moves go along the axes, so that a walk is as long as both parts together.
        return right.abs() + front.abs() <= self.protocol.radius + self.slack
