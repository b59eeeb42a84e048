"""The paper's agent: maps what it sees, hears where the source is, and plans the way there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent
from avn.apartments.floor_plan import CELL
from avn.core.actions import BACKWARD, FORWARD, HEADINGS, ROTATE_RIGHT, STOP
from avn.core.errors import UserError
from avn.core.pose import turned
from avn.mapping.base import Mapper
from avn.navigation.protocols import Protocol
from avn.planning.partial_graph import GraphRules
from avn.planning.shortest_path import NO_ACTION, first_actions
from avn.planning.source_belief import SourceBelief, SourceErrorModel

if TYPE_CHECKING:
    from avn.navigation.simulator import Simulator

LOOKS = ("once", "around")
# Parts in whose place it can be given the truth.
ORACLE_INPUTS = ("source_estimate", "local_patch", "map", "pose")
# A turn costs so little where it is free that it only decides between equal walks.
_TIE = 0.01


class PlannerAgent(Agent):
    """Walks along the shortest path of its partial graph to where the source is heard.

    At every step it takes the newest observation into its map, and plans anew. The target is the
    node nearest to the heard location that it has not searched yet: where it stood and the
    episode went on, the source is not. If the target is out of reach it goes to the node nearest to
    the heard location that is not.

    Parameters
    ----------
    mapper : Mapper
    look : {"once", "around"}
        Whether it turns at each new place until it has observed all four headings there.
    source_filter : {"latest", "bayes"}
        Whether the newest estimate of the source counts alone, or all together.
    error : HearingError
        How far estimates are trusted, for "bayes".
    obstacle_threshold, collision_cost : float
        See `GraphRules`.
    backward : bool
        Whether it may walk backward, where it sees nothing.
    max_rotations : int
        Quarter turns in one place after which it holds to the source as it heard it last until it
        has moved: what is heard facing one way may contradict what is heard facing another. After
        twice as many, and four more where it looks around, it walks straight on: where it takes
        itself to be may contradict itself too.
    stop_at : float
        Where the protocol has Stop, the probability of being within reach from which it says so.
    oracle_inputs : sequence of str
        Parts in whose place it is given the truth, which makes it privileged: `source_estimate` and
        `local_patch` come with the observations, `map` and `pose` go to the mapper.
    """

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
            if part in ("map", "pose") and part not in mapper.reveals:
                raise UserError(
                    f"agent.oracle_inputs: '{part}' is nothing that {type(mapper).__name__} can be "
                    "shown"
                )
        if look not in LOOKS:
            raise UserError(f"look: '{look}' is none of {', '.join(LOOKS)}")
        self.mapper, self.look, self.source_filter = mapper, look, source_filter
        self.rules = GraphRules(obstacle_threshold, collision_cost)
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
        """What it has to observe; where it has to say Stop, whether it is within reach."""
        return (*self.needs, "stop_probability") if protocol.requires_stop else self.needs

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Where the newest estimate counts alone, how far estimates are trusted."""
        return ("error",) if self.source_filter == "latest" else ()

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes."""
        super().reset(n, generator, protocol)
        self.mapper.reset(n, self.rules)
        self._search: SourceBelief | None = None
        # An episode without Stop ends in the cells round the source already.
        self._near = 1 if protocol.goal == "box" and not protocol.requires_stop else 0
        self._running = np.ones(n, dtype=np.bool_)
        self._way = torch.full((n,), -1)
        self._turns = torch.zeros(n, dtype=torch.int64)
        self._looked = torch.zeros(n, 0, dtype=torch.int64)

    def reveal(self, simulator: Simulator) -> None:
        """Show the mapper what it is given of the truth."""
        for part in ("map", "pose"):
            if part in self.oracle_inputs:
                self.mapper.reveal(part, simulator)

    def explore(self, walks: TensorDict, walk: Tensor) -> None:
        """Remember exploration walks; see `Mapper.explore`."""
        self.mapper.explore(walks, walk)

    def rest(self, done: Tensor) -> None:
        """Plan no more for episodes that are over."""
        self._running = ~done.numpy()
        self.mapper.rest(done)

    def act(self, observation: TensorDict) -> Tensor:
        """One action for every episode, along the path planned now."""
        self.mapper.observe(observation, self._way)
        self._listen(observation["source_estimate"], self._running)
        actions = self._planned(self._running)
        spins = self._turns >= 2 * self.max_rotations
        if self.look == "around":
            actions = torch.where(self._all_seen(), actions, ROTATE_RIGHT)
            spins = self._turns >= 2 * self.max_rotations + HEADINGS
        actions = torch.where(spins, FORWARD, actions)
        if self.protocol.requires_stop:
            actions = torch.where(observation["stop_probability"] >= self.stop_at, STOP, actions)
        self._way = torch.where(actions == FORWARD, 0, torch.where(actions == BACKWARD, 2, -1))
        self._turns = torch.where(self._way >= 0, 0, self._turns + 1)
        return actions

    def _listen(self, sound: Tensor, running: np.ndarray) -> None:
        """Turn what is heard into places on the map."""
        pose, graph = self.mapper.pose, self.mapper.graph
        if self._search is None:
            self._search = SourceBelief(self.n, graph.cost.shape[1], self.source_filter, self.error)
        place, heard = pose[:, :2].numpy(), sound.double() / CELL
        aim = self.mapper.location + turned(heard, pose[:, 2])
        behind = turned(heard * heard.new_tensor((1.0, -1.0)), pose[:, 2])
        mirrored = self.mapper.location + behind
        listens = running & (self._turns < self.max_rotations).numpy()
        self._search.listen(place, aim.numpy(), mirrored.numpy(), listens)
        # Where no Stop is needed, an episode that goes on tells that none of the cells around
        # holds the source; where it is, that the place itself does not.
        self._search.rule_out(place, self._near, running)

    def _planned(self, running: np.ndarray) -> Tensor:
        """The first action of the shortest path; a turn where there is no path to walk."""
        assert self._search is not None
        graph, search = self.mapper.graph, self._search
        target = search.targets(graph.cost, running)
        action, _, _ = first_actions(
            graph.cost,
            graph.walls,
            self.mapper.pose.numpy(),
            target,
            target.astype(np.float64),
            1.0 if self.protocol.counts_turns else _TIE,
            0.0 if self.backward else np.inf,
            running,
            self._near,
        )
        return torch.from_numpy(np.where(action == NO_ACTION, ROTATE_RIGHT, action))

    def _all_seen(self) -> Tensor:
        """Whether all four headings were observed at the place where each agent is."""
        size, pose = self.mapper.graph.cost.shape[1], self.mapper.pose
        if not self._looked.shape[1]:
            self._looked = torch.zeros(self.n, size * size, dtype=torch.int64)
        place = (pose[:, 1] * size + pose[:, 0])[:, None]
        seen = self._looked.gather(1, place) | 1 << pose[:, 2:]
        self._looked.scatter_(1, place, seen)
        return seen[:, 0] == (1 << HEADINGS) - 1
