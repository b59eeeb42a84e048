"""Rewards of reinforcement learning."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class RewardConfig:
    """Reward of each action.

    Attributes
    ----------
    success : float
        Reward of the action with which the episode succeeds.
    collision : float
        Reward of a blocked move.
    step : float
        Reward of any other action.
    """

    success: float = 10.0
    collision: float = -0.1
    step: float = -0.01
