"""The reward of each action, for reinforcement learning."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class RewardConfig:
    """What each action earns: one of the three.

    Attributes
    ----------
    success : float
        Where the episode succeeds.
    collision : float
        For a move that was blocked.
    step : float
        For any other action.
    """

    success: float = 10.0
    collision: float = -0.1
    step: float = -0.01
