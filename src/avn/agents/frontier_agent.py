"""Agent that explores the frontiers of its map in the heard direction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.agents.hearing_agent import HearingAgent
from avn.core.errors import UserError
from avn.core.heard import Arrivals
from avn.mapping.base import Mapper
from avn.navigation.protocols import Protocol
from avn.planning.frontiers import frontiers_towards

if TYPE_CHECKING:
    from tensordict import TensorDict


class FrontierAgent(HearingAgent):
    """Agent that walks to the frontier of its map nearest to the newest heard direction.

    See `avn.planning.frontiers`. Once it hears the source in sight, or no frontier is left, it
    walks to where it hears the source, as `PlannerAgent` does.

    Parameters
    ----------
    mapper : Mapper
        Builds the map and localises the agent; one with a map of squares.
    sector : float
        Step in which the angle between a frontier and the heard direction counts, degrees, more
        than 0 and up to 180; of frontiers of one step, the one of the fewest moves is chosen. With
        90, that is the nearest within 90 degrees of the direction, which was best on validation
        apartments, by two points of success over 10.
    sight_above : float
        Probability above which the source is taken to be in sight, 0 to 1; 1 for never.
    **hearing
        Other parameters of `HearingAgent`.

    Raises
    ------
    UserError
        If a setting is out of range, or the mapper has no map of squares.
    """

    def __init__(
        self, mapper: Mapper, sector: float = 90.0, sight_above: float = 0.5, **hearing: Any
    ) -> None:
        super().__init__(mapper, **hearing)
        if not 0 < sector <= 180:
            raise UserError(f"planner.sector: {sector}; give degrees, more than 0 and up to 180")
        if not 0 <= sight_above <= 1:
            raise UserError(f"planner.sight_above: {sight_above}; give 0 to 1")
        if type(mapper).belief is Mapper.belief:
            raise UserError(
                f"mapper: {type(mapper).__name__} has no map of squares; choose mapper=occupancy"
            )
        self.sector, self.sight_above = sector, sight_above

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes. See `Agent.reset`."""
        super().reset(n, generator, protocol)
        # a path leads beyond its frontier, not only beside it
        self._reach = 0
        self._in_sight = np.zeros(n, dtype=np.bool_)

    def _update_source(self, observation: TensorDict, active: np.ndarray) -> None:
        super()._update_source(observation, active)
        sight = torch.sigmoid(Arrivals(observation["arrival"].float()).in_sight)
        self._in_sight = (sight > self.sight_above).numpy()

    def _aim(self, heard: Arrivals, heading: Tensor) -> NDArray[np.float64]:
        return self._on_map(heard.location, heading)

    def _targets(self, active: np.ndarray) -> np.ndarray:
        rows = np.flatnonzero(active)
        belief = self.mapper.belief(torch.from_numpy(rows))
        assert belief is not None
        beyond, found = frontiers_towards(
            belief.numpy(),
            self.mapper.graph.walls[rows],
            self.mapper.pose.numpy()[rows, :2],
            self._heard[rows],
            self.sector / 360,
            ~self._in_sight[rows],
        )
        targets = super()._targets(active)
        targets[rows[found]] = beyond[found]
        return targets
