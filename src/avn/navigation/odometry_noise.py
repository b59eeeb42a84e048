"""Actions that fail unnoticed: wheels that slip, and turns that go too far."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.core.actions import BACKWARD, FORWARD, ROTATE_LEFT, ROTATE_RIGHT
from avn.core.errors import UserError
from avn.core.pose import turned
from avn.core.random import uniform


class OdometryNoise:
    """Random failures of actions that the odometry does not notice.

    The odometry counts every action that was not blocked as done. Its error grows with time.

    Parameters
    ----------
    slip : float
        Probability that a move or a rotation has no effect, 0 to 1.
    turn : float
        Probability that a rotation turns the agent twice as far, 0 to 1.

    Raises
    ------
    UserError
        If a probability is out of range, or their sum is more than 1.
    """

    def __init__(self, slip: float = 0.02, turn: float = 0.01) -> None:
        for key, value in (("slip", slip), ("turn", turn)):
            if not 0 <= value <= 1:
                raise UserError(f"odometry.{key}: {value}; give a probability, 0 to 1")
        if slip + turn > 1:
            raise UserError(
                f"odometry.slip, odometry.turn: {slip} and {turn}; their sum may be up to 1"
            )
        self.slip, self.turn = slip, turn

    def failures(
        self, keys: NDArray[np.uint64], step: Tensor, action: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Draw which actions of N agents slip, and which turn twice as far, (N,) bool each.

        Parameters
        ----------
        keys : (N,) uint64
            Key of each episode's random numbers.
        step : (N,) int64
            Number of actions before this one.
        action : (N,) int64
            See `avn.core.actions`.
        """
        draw = torch.from_numpy(uniform(keys, step.numpy()))
        rotates = (action == ROTATE_LEFT) | (action == ROTATE_RIGHT)
        slips = (draw < self.slip) & (rotates | (action <= BACKWARD))
        return slips, rotates & (draw >= self.slip) & (draw < self.slip + self.turn)


def reckoned(pose: Tensor, action: Tensor, blocked: Tensor) -> Tensor:
    """Return the poses after actions, as an odometry counts them.

    Parameters
    ----------
    pose : (N, 3) int64
        Cells to the right, cells to the front and quarter turns clockwise.
    action : (N,) int64
        See `avn.core.actions`.
    blocked : (N,) bool
        Moves that were blocked, which the odometry notices.
    """
    ahead = (action == FORWARD).long() - (action == BACKWARD).long()
    ahead = ahead.masked_fill(blocked, 0)
    away = turned(torch.stack((torch.zeros_like(ahead), ahead), 1), pose[:, 2])
    turns = (action == ROTATE_RIGHT).long() - (action == ROTATE_LEFT).long()
    return torch.cat((pose[:, :2] + away, ((pose[:, 2] + turns) % 4)[:, None]), 1)
