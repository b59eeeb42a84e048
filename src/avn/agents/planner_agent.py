"""The paper's agent, which maps the apartment, estimates the source and plans a path to it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from avn.agents.base import Agent
from avn.apartments.floor_plan import CELL
from avn.core.actions import BACKWARD, FORWARD, HEADINGS, ROTATE_RIGHT, STOP
from avn.core.errors import UserError
from avn.core.pose import turned
from avn.mapping.base import Mapper
from avn.navigation.protocols import Protocol
from avn.planning.partial_graph import GraphRules
from avn.planning.settings import SourceErrorModel
from avn.planning.shortest_path import NO_ACTION, first_actions
from avn.planning.source_belief import SourceBelief

if TYPE_CHECKING:
    from tensordict import TensorDict

    from avn.navigation.simulator import Simulator

LOOKS = ("once", "around")
# Observations and estimates that the ground truth can replace.
ORACLE_INPUTS = ("source_estimate", "arrival", "local_patch", "map", "pose")
# Cost of a turn that does not count: low enough that it only decides between equal paths.
_TIE = 0.01


class PlannerAgent(Agent):
    """Agent that follows the shortest path of its partial graph to the estimated source.

    At every step it updates the map with the newest observation and plans again. The target is the
    node nearest to the source estimate that it has not searched; a position is searched if the
    agent was there and the episode went on. If the target cannot be reached, the path leads to the
    reachable node nearest to it.

    Parameters
    ----------
    mapper : Mapper
        Builds the map and localises the agent.
    look : {"once", "around"}
        "around" turns at each new position until all four headings are observed; "once" does not.
    source_filter : {"latest", "bayes"}
        "latest" uses the newest source estimate alone; "bayes" combines all estimates.
    error : SourceErrorModel
        Error model of the source estimates, for "bayes".
    obstacle_threshold : float
        Squares whose probability of being free is below this are no nodes, 0 to 1. Above 0.5, for
        agents that explore, unknown squares are none either.
    collision_cost : float
        Cost of a collision, moves, 0 to 1000: entering a square that is free with probability p
        costs 1 + `collision_cost` (1 - p).
    backward : bool
        True if the agent may move backward.
    max_rotations : int
        Quarter turns at one position after which it keeps the source estimate until it has moved,
        1 or more, since estimates of different headings may contradict each other. After twice as
        many, and four more with "around", it moves forward, since pose estimates may also
        contradict each other.
    stop_at : float
        Probability of being at the goal from which the agent stops, 0 to 1; for protocols with
        Stop.
    oracle_inputs : sequence of str
        Inputs that the ground truth replaces, which makes the agent privileged:
        `source_estimate`, `arrival`, `local_patch`, `map` and `pose`. The last two are set in the
        mapper, the others come with the observations.

    Raises
    ------
    UserError
        If a setting is out of range, or the mapper has no use for an oracle input.
    """

    # whether it plans by the paths of sound, `Mapper.sound_graph`
    uses_sound_graph: bool = False

    def __init__(
        self,
        mapper: Mapper,
        look: str = "once",
        source_filter: str = "latest",
        error: SourceErrorModel | None = None,
        obstacle_threshold: float = 0.5,
        collision_cost: float = 0.0,
        backward: bool = False,
        max_rotations: int = 4,
        stop_at: float = 0.5,
        oracle_inputs: Sequence[str] = (),
    ) -> None:
        for part in oracle_inputs:
            if part not in ORACLE_INPUTS:
                raise UserError(
                    f"agent.oracle_inputs: '{part}' is none of {', '.join(ORACLE_INPUTS)}"
                )
            if part in ("map", "pose") and part not in mapper.ground_truths:
                raise UserError(
                    f"agent.oracle_inputs: '{part}' is nothing that {type(mapper).__name__} can be "
                    "shown"
                )
        if look not in LOOKS:
            raise UserError(f"look: '{look}' is none of {', '.join(LOOKS)}")
        self.mapper, self.look, self.source_filter = mapper, look, source_filter
        self.rules = GraphRules(obstacle_threshold, collision_cost)
        if obstacle_threshold > 0.5 and not mapper.explores:
            raise UserError(
                f"planner.obstacle_threshold: {obstacle_threshold}; give 0 to 0.5, for an unknown "
                "square is believed to be free by 0.5 and must be a node where nothing was explored"
            )
        self.error = error or SourceErrorModel()
        if max_rotations < 1:
            raise UserError(
                f"planner.max_rotations: {max_rotations} is less than 1, so it could not turn"
            )
        self.backward, self.max_rotations, self.stop_at = backward, max_rotations, stop_at
        self.oracle_inputs, self.privileged = tuple(oracle_inputs), bool(oracle_inputs)  # type: ignore[misc]
        self.explores = mapper.explores
        self.needs = ("source_estimate", *mapper.needs)  # type: ignore[misc]

    def wants(self, protocol: Protocol) -> tuple[str, ...]:
        """Return the observations it needs, with `stop_probability` if the protocol has Stop."""
        return (*self.needs, "stop_probability") if protocol.requires_stop else self.needs

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Return `error` for the filter "latest". See `Agent.unused_settings`."""
        return ("error",) if self.source_filter == "latest" else ()

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes. See `Agent.reset`."""
        super().reset(n, generator, protocol)
        self.mapper.reset(n, self.rules)
        self._source_belief: SourceBelief | None = None
        # Without Stop an episode also ends in the cells around the source.
        self._near = 1 if protocol.goal == "box" and not protocol.requires_stop else 0
        # Squares between a target and the end of the path to it.
        self._reach = self._near
        self._active = np.ones(n, dtype=np.bool_)
        self._direction = torch.full((n,), -1)
        self._turns = torch.zeros(n, dtype=torch.int64)
        self._looked = torch.zeros(n, 0, dtype=torch.int64)

    def set_ground_truth(self, simulator: Simulator) -> None:
        """Give the mapper the true map and pose, if chosen. See `Agent.set_ground_truth`."""
        for part in ("map", "pose"):
            if part in self.oracle_inputs:
                self.mapper.set_ground_truth(part, simulator)

    def explore(self, trajectories: TensorDict, trajectory_index: Tensor) -> None:
        """Give the mapper the exploration trajectories. See `Agent.explore`."""
        self.mapper.explore(trajectories, trajectory_index)

    def set_active(self, active: Tensor) -> None:
        """Set which episodes are planned for. See `Agent.set_active`."""
        self._active = active.numpy()
        self.mapper.set_active(active)

    def act(self, observation: TensorDict) -> Tensor:
        """Choose an action for every episode along the newest path. See `Agent.act`."""
        self.mapper.observe(observation, self._direction)
        self._update_source(observation, self._active)
        actions = self._planned(self._active)
        spins = self._turns >= 2 * self.max_rotations
        if self.look == "around":
            actions = torch.where(self._all_seen(), actions, ROTATE_RIGHT)
            spins = self._turns >= 2 * self.max_rotations + HEADINGS
        actions = torch.where(spins, FORWARD, actions)
        if self.protocol.requires_stop:
            actions = self._with_stops(observation, actions)
        self._direction = torch.where(
            actions == FORWARD, 0, torch.where(actions == BACKWARD, 2, -1)
        )
        self._turns = torch.where(self._direction >= 0, 0, self._turns + 1)
        return actions

    def _with_stops(self, observation: TensorDict, actions: Tensor) -> Tensor:
        """Return the actions, with Stop where an agent stops; for protocols with Stop."""
        return torch.where(self._stops(observation), STOP, actions)

    def _stops(self, observation: TensorDict) -> Tensor:
        """Return which agents stop, (N,) bool; for protocols with Stop."""
        stops: Tensor = observation["stop_probability"] >= self.stop_at
        return stops

    def _update_source(self, observation: TensorDict, active: np.ndarray) -> None:
        """Update the belief of the source with the newest estimates, in the frame of the map."""
        estimate = observation["source_estimate"]
        pose, graph = self.mapper.pose, self.mapper.graph
        if self._source_belief is None:
            self._source_belief = SourceBelief(
                self.n, graph.cost.shape[1], self.source_filter, self.error
            )
        position, offset = pose[:, :2].numpy(), estimate.double() / CELL
        source_estimate = self.mapper.location + turned(offset, pose[:, 2])
        behind = turned(offset * offset.new_tensor((1.0, -1.0)), pose[:, 2])
        mirror_image = self.mapper.location + behind
        updated = active & (self._turns < self.max_rotations).numpy()
        self._source_belief.update(position, source_estimate.numpy(), mirror_image.numpy(), updated)
        # An episode without Stop that goes on has no source in the cells around the agent; one
        # with Stop has none in the agent's own cell.
        self._source_belief.rule_out(position, self._near, active)

    def _targets(self, active: np.ndarray) -> np.ndarray:
        """Return the square where each agent looks for the source next, (N, 2) int64."""
        assert self._source_belief is not None
        return self._source_belief.targets(self.mapper.graph.cost, active)

    def _planned(self, active: np.ndarray) -> Tensor:
        """Return the first action of the shortest path, and a turn if there is none."""
        graph, target = self.mapper.graph, self._targets(active)
        action, _, _ = first_actions(
            graph.cost,
            graph.walls,
            self.mapper.pose.numpy(),
            target,
            target.astype(np.float64),
            1.0 if self.protocol.counts_turns else _TIE,
            0.0 if self.backward else np.inf,
            active,
            self._reach,
        )
        return torch.from_numpy(np.where(action == NO_ACTION, ROTATE_RIGHT, action))

    def _all_seen(self) -> Tensor:
        """Return True if all four headings were observed at the agent's position, (N,) bool."""
        size, pose = self.mapper.graph.cost.shape[1], self.mapper.pose
        if not self._looked.shape[1]:
            self._looked = torch.zeros(self.n, size * size, dtype=torch.int64)
        position = (pose[:, 1] * size + pose[:, 0])[:, None]
        seen = self._looked.gather(1, position) | 1 << pose[:, 2:]
        self._looked.scatter_(1, position, seen)
        return seen[:, 0] == (1 << HEADINGS) - 1
