"""Traces of walks that an agent takes, kept as it walks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent
from avn.apartments.floor_plan import CELL
from avn.core.actions import HEADINGS
from avn.core.pose import FRONT, RIGHT, turned
from avn.mapping.base import Mapper
from avn.navigation.simulator import Simulator, drawn_realisations
from avn.navigation.trace import BeliefTrace, Trace

# Squares beyond the outermost cells that a picture of a belief still shows.
MARGIN = 2


class Recorder:
    """Looks on at walks (`avn.agents.rollout.Watch`) and keeps the traces of some episodes.

    Parameters
    ----------
    rows : mapping of str to sequence of int
        By room, the places of the episodes in its batch.
    realisations : int
        How many takes of each clip there are.
    beliefs : bool
        Whether it also keeps what agents with maps took to be true.
    """

    def __init__(self, rows: Mapping[str, Sequence[int]], realisations: int, beliefs: bool) -> None:
        self._rows = {room: torch.as_tensor(list(own)).long() for room, own in rows.items()}
        self._realisations, self._keeps_beliefs = realisations, beliefs
        self._steps: dict[str, list[dict[str, Tensor]]] = {}
        self._rooms: dict[str, tuple[Simulator, bool]] = {}
        self._frames: dict[str, _Frames] = {}

    def __call__(
        self, simulator: Simulator, agent: Agent, observation: TensorDict, actions: Tensor | None
    ) -> bool:
        """Keep one step of the chosen episodes of a room; tells whether all of them are over."""
        room = simulator.place.name
        rows = self._rows.get(room, torch.empty(0).long())
        if not len(rows):
            return True
        if room not in self._rooms:
            self._rooms[room] = simulator, agent.explores
        step = {"state": simulator.state[rows], "collided": observation["collided"][rows]}
        sound = observation.get("source_estimate", None)
        if sound is not None and sound.dim() == 2 and sound.shape[1] == 2:
            step["source_estimates"] = sound[rows]
        if actions is not None:
            step["action"] = actions[rows]
            mapper = getattr(agent, "mapper", None)
            if self._keeps_beliefs and isinstance(mapper, Mapper):
                step |= self._beliefs(simulator, mapper, rows)
        self._steps.setdefault(room, []).append({key: x.clone() for key, x in step.items()})
        return bool(simulator.done[rows].all())

    def _beliefs(self, simulator: Simulator, mapper: Mapper, rows: Tensor) -> dict[str, Tensor]:
        """What a mapper holds true now, in the apartment's frame."""
        room = simulator.place.name
        if room not in self._frames:
            self._frames[room] = _Frames(simulator, mapper, rows)
        frames = self._frames[room]
        found = {"pose": frames.place(mapper, rows)}
        if (belief := mapper.belief(rows)) is not None:
            found["free"] = frames.squares(belief)
        if mapper.retrieved is not None:
            similarity, places = mapper.retrieved
            found |= {"similarity": similarity[rows], "retrieved": frames.entries(places[rows])}
        return found

    def trace(self, room: str, row: int, record: Mapping[str, Any]) -> Trace:
        """The trace of an episode that was walked to its end."""
        simulator, explores = self._rooms[room]
        at = self._rows[room].tolist().index(row)
        count = int(simulator.actions[row])
        steps = self._steps[room]

        def stacked(key: str, length: int) -> NDArray[Any] | None:
            if key not in steps[0]:
                return None
            return np.stack([step[key][at].numpy() for step in steps[:length]])

        state, source_estimates = (
            stacked("state", count + 1),
            stacked("source_estimates", count + 1),
        )
        episodes, pose = simulator.episodes, stacked("pose", count)
        assert state is not None
        if source_estimates is not None:
            offsets = turned(
                torch.from_numpy(source_estimates).double(), torch.from_numpy(state % HEADINGS)
            )
            source_estimates = simulator.place.grid.centres[state // HEADINGS] + offsets.numpy()
        beliefs = None
        if pose is not None:
            own = [stacked(key, count) for key in ("free", "similarity", "retrieved")]
            beliefs = BeliefTrace(pose, self._frames[room].low, *own)
        draws = simulator.protocol.max_actions + 1
        # one episode's draws are asked for, so that a room with thousands costs no more
        realisations = drawn_realisations(episodes, draws, self._realisations, [row])[
            0, : count + 1
        ]
        return Trace(
            place=simulator.place,
            record=record,
            sound=int(episodes.sound[row]),
            source=int(episodes.source[row]),
            state=state,
            action=np.asarray(stacked("action", count)),
            collided=np.asarray(stacked("collided", count + 1)),
            realisation=realisations.numpy().astype(np.int64),
            source_estimates=source_estimates,
            beliefs=beliefs,
            walk=episodes.walks[episodes.walk[row]] if explores else None,
        )


class _Frames:
    """Where the maps of R agents lie in their apartment; what an agent itself never knows."""

    def __init__(self, simulator: Simulator, mapper: Mapper, rows: Tensor) -> None:
        lattice = torch.from_numpy(np.asarray(simulator.place.grid.lattice)).long()
        episodes, self._size = simulator.episodes, mapper.graph.cost.shape[1]
        start = simulator.start[rows]
        walks = torch.from_numpy(episodes.walks)
        begin = walks[torch.from_numpy(episodes.walk)[rows], 0] if len(walks) else start
        self._walk = lattice[begin // HEADINGS], begin % HEADINGS
        own = begin if mapper.in_walk else start
        self._origin, self._heading = lattice[own // HEADINGS], own % HEADINGS
        low, high = lattice.amin(0) - MARGIN, lattice.amax(0) + MARGIN
        self.low = low.numpy()
        x, y = (torch.arange(int(a), int(b) + 1) for a, b in zip(low, high, strict=True))
        world = torch.stack(torch.meshgrid(x, y, indexing="xy"), dim=-1)
        away = world[None] - self._origin[:, None, None]
        centre = self._size // 2
        right, front = (
            (away * axis[self._heading][:, None, None]).sum(dim=-1) + centre
            for axis in (RIGHT, FRONT)
        )
        self._inside = (torch.stack((right, front)) >= 0).all(0)
        self._inside &= (torch.stack((right, front)) < self._size).all(0)
        self._index = torch.where(self._inside, front * self._size + right, 0)

    def place(self, mapper: Mapper, rows: Tensor) -> Tensor:
        """East, north and heading of where the agents take themselves to be, (R, 3) float64."""
        away = turned(mapper.location[rows] - self._size // 2, self._heading)
        heading = (mapper.pose[rows, 2] + self._heading) % HEADINGS
        return torch.cat((CELL * (self._origin + away), heading[:, None].double()), dim=1)

    def squares(self, belief: Tensor) -> Tensor:
        """Beliefs (R, M, M) on the squares of the apartment, (R, H, W) uint8."""
        found = belief.flatten(1).gather(1, self._index.flatten(1)).view(self._index.shape)
        return (255 * torch.where(self._inside, found, 0.5)).round().to(torch.uint8)

    def entries(self, places: Tensor) -> Tensor:
        """Entries (R, k, 3) of a memory as east, north and heading, float64."""
        origin, heading = self._walk
        where = CELL * (origin[:, None] + turned(places[..., :2], heading)).double()
        return torch.cat((where, ((places[..., 2:] + heading[:, None, None]) % HEADINGS)), dim=2)
