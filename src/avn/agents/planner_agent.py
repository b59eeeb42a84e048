"""The paper's agent: maps what it sees, hears where the source is, and plans the way there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
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
from avn.planning.source_search import HearingError, SourceSearch

if TYPE_CHECKING:
    from avn.navigation.simulator import Simulator

LOOKS = ("once", "around")
# Parts in whose place it can be given the truth.
TRUTH = ("location", "window", "map", "pose")
# A turn costs so little where it is free that it only decides between equal walks.
_TIE = 0.01


@dataclass
class PlannerBase:
    """What every option of the config group `planner` has; a null target is no planner."""

    _target_: str | None = None
    name: str = "none"


@dataclass
class PlannerConfig(PlannerBase):
    """Schema of `planner=dijkstra`; the fields mean what `PlannerAgent` says."""

    look: str = "once"
    source: str = "newest"
    blocked_below: float = 0.5
    detour: float = 0.0
    backward: bool = False
    patience: int = 4
    error: HearingError = field(default_factory=HearingError)


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
    source : {"newest", "belief"}
        Whether the newest estimate of the source counts alone, or all together.
    error : HearingError
        How far estimates are trusted, for "belief".
    blocked_below, detour : float
        See `GraphRules`.
    backward : bool
        Whether it may walk backward, where it sees nothing.
    patience : int
        Quarter turns in one place after which it holds to the source as it heard it last until it
        has moved: what is heard facing one way may contradict what is heard facing another. After
        twice as many, and four more where it looks around, it walks straight on: where it takes
        itself to be may contradict itself too.
    stop_at : float
        Where the protocol has Stop, the probability of being within reach from which it says so.
    truth : sequence of str
        Parts in whose place it is given the truth, which makes it privileged: `location` of the
        source and `window` come with the observations, `map` and `pose` go to the mapper.
    """

    def __init__(
        self,
        mapper: Mapper,
        look: str = "once",
        source: str = "newest",
        error: HearingError | None = None,
        blocked_below: float = 0.5,
        detour: float = 0.0,
        backward: bool = False,
        patience: int = 4,
        stop_at: float = 0.5,
        truth: Sequence[str] = (),
    ) -> None:
        for part in truth:
            if part not in TRUTH:
                raise UserError(f"agent.truth: '{part}' is none of {', '.join(TRUTH)}")
            if part in ("map", "pose") and part not in mapper.reveals:
                raise UserError(
                    f"agent.truth: '{part}' is nothing that {type(mapper).__name__} can be shown"
                )
        if look not in LOOKS:
            raise UserError(f"look: '{look}' is none of {', '.join(LOOKS)}")
        self.mapper, self.look, self.source = mapper, look, source
        self.rules = GraphRules(blocked_below, detour)
        self.error = error or HearingError()
        if patience < 1:
            raise UserError(f"planner.patience: {patience} is less than 1, so it could not turn")
        self.backward, self.patience, self.stop_at = backward, patience, stop_at
        self.truth, self.privileged = tuple(truth), bool(truth)  # type: ignore[misc]
        self.explores = mapper.explores
        self.needs = ("sound", *mapper.needs)  # type: ignore[misc]

    def wants(self, protocol: Protocol) -> tuple[str, ...]:
        """What it has to observe; where it has to say Stop, whether it is within reach."""
        return (*self.needs, "reach") if protocol.says_stop else self.needs

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Where the newest estimate counts alone, how far estimates are trusted."""
        return ("error",) if self.source == "newest" else ()

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes."""
        super().reset(n, generator, protocol)
        self.mapper.reset(n, self.rules)
        self._search: SourceSearch | None = None
        # An episode without Stop ends in the cells round the source already.
        self._near = 1 if protocol.goal == "box" and not protocol.says_stop else 0
        self._running = np.ones(n, dtype=np.bool_)
        self._way = torch.full((n,), -1)
        self._turns = torch.zeros(n, dtype=torch.int64)
        self._looked = torch.zeros(n, 0, dtype=torch.int64)

    def reveal(self, simulator: Simulator) -> None:
        """Show the mapper what it is given of the truth."""
        for part in ("map", "pose"):
            if part in self.truth:
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
        self._listen(observation["sound"], self._running)
        actions = self._planned(self._running)
        spins = self._turns >= 2 * self.patience
        if self.look == "around":
            actions = torch.where(self._all_seen(), actions, ROTATE_RIGHT)
            spins = self._turns >= 2 * self.patience + HEADINGS
        actions = torch.where(spins, FORWARD, actions)
        if self.protocol.says_stop:
            actions = torch.where(observation["reach"] >= self.stop_at, STOP, actions)
        self._way = torch.where(actions == FORWARD, 0, torch.where(actions == BACKWARD, 2, -1))
        self._turns = torch.where(self._way >= 0, 0, self._turns + 1)
        return actions

    def _listen(self, sound: Tensor, running: np.ndarray) -> None:
        """Turn what is heard into places on the map."""
        pose, graph = self.mapper.pose, self.mapper.graph
        if self._search is None:
            self._search = SourceSearch(self.n, graph.cost.shape[1], self.source, self.error)
        place, heard = pose[:, :2].numpy(), sound.double() / CELL
        aim = self.mapper.location + turned(heard, pose[:, 2])
        behind = turned(heard * heard.new_tensor((1.0, -1.0)), pose[:, 2])
        mirrored = self.mapper.location + behind
        listens = running & (self._turns < self.patience).numpy()
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
