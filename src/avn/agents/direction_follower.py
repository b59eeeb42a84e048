"""Agent that walks in the newest heard direction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.agents.hearing_agent import HearingAgent
from avn.core.errors import UserError
from avn.core.heard import Arrivals
from avn.mapping.base import Mapper


class DirectionFollower(HearingAgent):
    """Agent that walks to the place a fixed distance ahead in the newest heard direction.

    It takes the shortest path of its partial graph to the node nearest to this place that it has
    not searched, as `PlannerAgent` does with a heard location.

    Parameters
    ----------
    mapper : Mapper
        Builds the map and localises the agent.
    ahead : float
        Distance of the place, metres, 1 to 50. A place nearer than that may be no other square.
    **hearing
        Other parameters of `HearingAgent`.

    Raises
    ------
    UserError
        If a setting is out of range.
    """

    def __init__(self, mapper: Mapper, ahead: float = 2.0, **hearing: Any) -> None:
        super().__init__(mapper, **hearing)
        if not 1 <= ahead <= 50:
            raise UserError(f"planner.ahead: {ahead}; give metres, 1 to 50")
        self.ahead = ahead

    def _aim(self, heard: Arrivals, heading: Tensor) -> NDArray[np.float64]:
        angle = heard.bearing.argmax(-1) * (2 * math.pi / heard.bins)
        return self._on_map(self.ahead * torch.stack((angle.sin(), angle.cos()), -1), heading)
