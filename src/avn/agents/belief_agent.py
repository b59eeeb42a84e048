"""Agent that keeps a posterior of the source on its map, from the arrival of the sound."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.agents.planner_agent import PlannerAgent
from avn.agents.stop_threshold import check_half_life, stop_threshold
from avn.apartments.floor_plan import CELL
from avn.core.actions import ROTATE_RIGHT, STOP
from avn.core.errors import UserError
from avn.core.heard import Arrivals
from avn.mapping.base import Mapper
from avn.navigation.protocols import Protocol
from avn.planning.arrival_belief import ArrivalBelief
from avn.planning.posterior import likely
from avn.planning.settings import ArrivalModel

if TYPE_CHECKING:
    from tensordict import TensorDict

STOPS = ("belief", "classifier")
TARGETS = ("goal", "square")
DIRECT_PATHS = ("diffraction", "transmission")


class BeliefAgent(PlannerAgent):
    """Agent that walks to the likeliest square of a posterior; see `ArrivalBelief`.

    Parameters
    ----------
    mapper : Mapper
        Builds the map and localises the agent.
    model : ArrivalModel
        Weights of the evidence.
    stop_by : {"belief", "classifier"}
        What the decision to stop rests on, for protocols with Stop: "belief" is the probability
        that the agent is at the goal, by the posterior; "classifier" that of the stop classifier.
    stop_above : float
        Probability from which it stops by "belief", more than 0 and up to 1.
    stop_at : float
        Probability from which it stops by "classifier", 0 to 1.
    confirm : bool
        Whether it turns until it has heard all four headings of a square before it stops there.
    least_information : float
        Information of a direction of arrival, in nats, below which nothing counts as heard: the
        difference of its entropy from that of a uniform distribution; 0 or more. Where it has heard
        nothing yet, the agent turns.
    target : {"goal", "square"}
        Where it walks to: the square from which success is likeliest, or the likeliest square of
        the source.
    silent_after : int
        Actions in a row without hearing anything after which the sound counts as ended, 1 or more:
        the agent then stops at the likeliest square, for protocols with Stop.
    stop_half_life : float or None
        Actions after which `stop_above` has halved, more than 0; None for never.
    direct_path : {"diffraction", "transmission"}
        How it believes that sound arrives: along the shortest path of the map, or in a straight
        line through what is between; see `AcousticsConfig`.
    **planner
        Other parameters of `PlannerAgent`, without those of its source filter.
    """

    def __init__(
        self,
        mapper: Mapper,
        model: ArrivalModel | None = None,
        stop_by: str = "belief",
        stop_above: float = 0.5,
        stop_at: float = 0.5,
        confirm: bool = True,
        least_information: float = 0.0,
        target: str = "goal",
        silent_after: int = 8,
        stop_half_life: float | None = None,
        direct_path: str = "diffraction",
        **planner: Any,
    ) -> None:
        super().__init__(mapper, stop_at=stop_at, **planner)
        if stop_by not in STOPS:
            raise UserError(f"planner.stop_by: '{stop_by}' is none of {', '.join(STOPS)}")
        if not 0 < stop_above <= 1:
            raise UserError(f"planner.stop_above: {stop_above}; give more than 0 and up to 1")
        self.model, self.stop_by, self.stop_above = model or ArrivalModel(), stop_by, stop_above
        if self.model.shared_by_headings is None:
            shared = 1.0 if self.look == "around" else 0.0
            self.model = replace(self.model, shared_by_headings=shared)
        if target not in TARGETS:
            raise UserError(f"planner.target: '{target}' is none of {', '.join(TARGETS)}")
        self.target = target
        if silent_after < 1:
            raise UserError(f"planner.silent_after: {silent_after}; give actions, 1 or more")
        self.silent_after = silent_after
        check_half_life(stop_half_life)
        if not least_information >= 0:
            raise UserError(f"planner.least_information: {least_information}; give nats, 0 or more")
        if direct_path not in DIRECT_PATHS:
            raise UserError(
                f"planner.direct_path: '{direct_path}' is none of {', '.join(DIRECT_PATHS)}"
            )
        self.direct_path, self.uses_sound_graph = direct_path, direct_path == "diffraction"
        self.confirm, self.stop_half_life = confirm, stop_half_life
        self.least_information = least_information
        self.needs = ("arrival", *mapper.needs)  # type: ignore[misc]

    def wants(self, protocol: Protocol) -> tuple[str, ...]:
        """Return the observations it needs under a protocol. See `Agent.wants`."""
        classified = protocol.requires_stop and self.stop_by == "classifier"
        return (*self.needs, "stop_probability") if classified else self.needs

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Return the settings of the source filter, and those of Stop that do not count."""
        classified = protocol.requires_stop and self.stop_by == "classifier"
        stop = () if protocol.requires_stop else ("stop_by", "confirm")
        posterior = ("stop_above", "stop_half_life", "silent_after")
        unread = posterior if classified or not protocol.requires_stop else ()
        return ("source_filter", "error", *stop, *unread)

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes. See `Agent.reset`."""
        super().reset(n, generator, protocol)
        self._belief: ArrivalBelief | None = None
        self._actions, self._silent = 0, np.zeros(n, dtype=np.int64)
        self._goal = goal_offsets(protocol)

    def posterior(self, rows: Tensor) -> Tensor | None:
        """Return the posterior of the source. See `Agent.posterior`."""
        if self._belief is None:
            return None
        return torch.from_numpy(likely(self._belief.log_belief[rows.numpy()]))

    def _update_source(self, observation: TensorDict, active: np.ndarray) -> None:
        heard = Arrivals(observation["arrival"].float())
        pose, graph = self.mapper.pose.numpy(), self.mapper.graph
        if self._belief is None:
            self._belief = ArrivalBelief(self.n, graph.cost.shape[1], heard.bins, self.model)
        belief = self._belief
        squares = heard.distance - torch.tensor([math.log(CELL), 0.0])
        self._actions += 1
        audible = (heard.information >= self.least_information).numpy()
        self._silent = np.where(audible, 0, self._silent + 1)
        belief.hear(pose, heard.bearing.numpy(), squares.numpy(), active, audible)
        if not (self.protocol.requires_stop and self.stop_by == "belief"):
            belief.rule_out(pose[:, :2], self._near, active)
        belief.score(graph.cost, active, self._sound_cost)

    def _targets(self, active: np.ndarray) -> np.ndarray:
        assert self._belief is not None
        around = self._goal if self.target == "goal" else None
        cost = self.mapper.graph.cost
        return self._belief.targets(cost, active, around, self._sound_cost)

    @property
    def _sound_cost(self) -> NDArray[np.float32] | None:
        """Costs of the squares for sound; None where they are those of the agent."""
        if self.direct_path == "transmission":
            return np.ones_like(self.mapper.graph.cost)
        graph = self.mapper.sound_graph
        return None if graph is None else graph.cost

    def _planned(self, active: np.ndarray) -> Tensor:
        """Return the first action of the shortest path; a turn for those who heard nothing."""
        assert self._belief is not None
        informed = torch.from_numpy(self._belief.informed())
        return torch.where(informed, super()._planned(active), ROTATE_RIGHT)

    def _with_stops(self, observation: TensorDict, actions: Tensor) -> Tensor:
        stops = self._stops(observation)
        if self.confirm:
            assert self._belief is not None
            heard = torch.from_numpy(self._belief.heard_around())
            actions = torch.where(stops, ROTATE_RIGHT, actions)
            stops &= heard
        return torch.where(stops, STOP, actions)

    def _stops(self, observation: TensorDict) -> Tensor:
        if self.stop_by == "classifier":
            return super()._stops(observation)
        assert self._belief is not None
        position = self.mapper.pose[:, :2].numpy()
        enough = stop_threshold(self.stop_above, self.stop_half_life, self._actions)
        stops = self._belief.near(position, self._goal, self._active) >= enough
        # nothing more will be learnt: the likeliest square is the best guess
        ended = (self._silent >= self.silent_after) & self._belief.informed()
        at_target = (self._targets(self._active & ended) == position).all(1)
        return torch.from_numpy(stops | (ended & at_target))


def goal_offsets(protocol: Protocol) -> NDArray[np.int64]:
    """Return the offsets from a goal square to the source, columns and rows, (k, 2) int64.

    They are those of a protocol's goal without walls: the 3 x 3 squares, or those that fewer moves
    than the radius lead to.
    """
    most = 1 if protocol.goal == "box" else protocol.most_goal_moves
    offsets = np.stack(np.meshgrid(*[np.arange(-most, most + 1)] * 2), -1).reshape(-1, 2)
    if protocol.goal == "box":
        return offsets
    return offsets[np.abs(offsets).sum(1) <= most]
