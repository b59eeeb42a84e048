"""Base class of agents that walk by the newest heard arrival of the sound alone."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.agents.planner_agent import PlannerAgent
from avn.agents.stop_threshold import check_half_life, stop_threshold
from avn.apartments.floor_plan import CELL
from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.heard import Arrivals
from avn.core.pose import turned
from avn.mapping.base import Mapper
from avn.navigation.protocols import Protocol
from avn.planning.settings import SourceErrorModel
from avn.planning.source_belief import SourceBelief

if TYPE_CHECKING:
    from tensordict import TensorDict


class HearingAgent(PlannerAgent):
    """Agent whose target follows from the newest arrival of the sound; it keeps no posterior.

    Parameters
    ----------
    mapper : Mapper
        Builds the map and localises the agent.
    stop_within : float
        Length of the path of the sound below which the agent stops, for protocols with Stop;
        metres, more than 0 and up to 100. The path ends at the height of the source.
    stop_above : float
        Probability of such a length, by the heard distribution, from which it stops; more than 0
        and below 1.
    stop_half_life : float or None
        Actions after which `stop_above` has halved, more than 0; None for never.
    least_information : float
        Information of a direction of arrival, in nats, below which nothing counts as heard, 0 or
        more; the agent then keeps what it heard before.
    silent_after : int
        Actions in a row without hearing anything after which the sound counts as ended, 1 or more:
        the agent then stops where it is, for protocols with Stop.
    **planner
        Other parameters of `PlannerAgent`, without those of its source filter.

    Raises
    ------
    UserError
        If a setting is out of range.
    """

    def __init__(
        self,
        mapper: Mapper,
        stop_within: float = 0.9,
        stop_above: float = 0.5,
        stop_half_life: float | None = None,
        least_information: float = 0.0,
        silent_after: int = 8,
        **planner: Any,
    ) -> None:
        super().__init__(mapper, **planner)
        if not 0 < stop_within <= 100:
            raise UserError(
                f"planner.stop_within: {stop_within}; give metres, more than 0 and up to 100"
            )
        if not 0 < stop_above < 1:
            raise UserError(f"planner.stop_above: {stop_above}; give more than 0 and less than 1")
        check_half_life(stop_half_life)
        if not least_information >= 0:
            raise UserError(f"planner.least_information: {least_information}; give nats, 0 or more")
        if silent_after < 1:
            raise UserError(f"planner.silent_after: {silent_after}; give actions, 1 or more")
        self.silent_after = silent_after
        self.stop_within, self.stop_above = stop_within, stop_above
        self.stop_half_life = stop_half_life
        self.least_information = least_information
        self.needs = ("arrival", *mapper.needs)  # type: ignore[misc]

    def wants(self, protocol: Protocol) -> tuple[str, ...]:
        """Return the observations it needs, the same under every protocol. See `Agent.wants`."""
        return self.needs

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Return the settings of the source filter, and those of Stop that do not count."""
        stops = ("stop_within", "stop_above", "stop_half_life", "silent_after")
        stop = () if protocol.requires_stop else stops
        return ("source_filter", "error", *stop)

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes. See `Agent.reset`."""
        super().reset(n, generator, protocol)
        # direction on the map, turns clockwise from its front
        self._heard = np.zeros(n)
        self._actions, self._silent = 0, np.zeros(n, dtype=np.int64)
        self._informed = np.zeros(n, dtype=np.bool_)

    def _update_source(self, observation: TensorDict, active: np.ndarray) -> None:
        heard = Arrivals(observation["arrival"].float())
        pose = self.mapper.pose
        self._actions += 1
        if self._source_belief is None:
            size = self.mapper.graph.cost.shape[1]
            self._source_belief = SourceBelief(self.n, size, "latest", SourceErrorModel())
        # Directions heard with different headings at one place may contradict each other.
        updated = active & (self._turns < self.max_rotations).numpy()
        audible = (heard.information >= self.least_information).numpy()
        self._silent = np.where(audible, 0, self._silent + 1)
        # before anything was heard, any direction will do
        updated &= audible | ~self._informed
        self._informed |= audible
        turns = heard.bearing.argmax(-1).numpy() / heard.bins + pose[:, 2].numpy() / HEADINGS
        self._heard = np.where(updated, turns % 1.0, self._heard)
        aim = self._aim(heard, pose[:, 2])
        self._source_belief.update(pose[:, :2].numpy(), aim, aim, updated)
        self._source_belief.rule_out(pose[:, :2].numpy(), self._near, active)

    @abstractmethod
    def _aim(self, heard: Arrivals, heading: Tensor) -> NDArray[np.float64]:
        """Return the column and row of the place that the agents walk to, (N, 2) float64."""

    def _stops(self, observation: TensorDict) -> Tensor:
        heard = Arrivals(observation["arrival"].float())
        mean, sigma = heard.distance.unbind(-1)
        within = torch.special.ndtr((math.log(self.stop_within) - mean) / sigma)
        enough = stop_threshold(self.stop_above, self.stop_half_life, self._actions)
        near = (within >= enough) & (heard.information >= self.least_information)
        # nothing more will be learnt
        ended = (self._silent >= self.silent_after) & self._informed
        return near | torch.from_numpy(ended)

    def _on_map(self, metres: Tensor, heading: Tensor) -> NDArray[np.float64]:
        """Return the column and row of places (N, 2) in metres to the agents' right and front."""
        away: Tensor = turned(metres.double() / CELL, heading)
        return (self.mapper.location + away).numpy()
