"""Recorder of the traces of episodes while an agent runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.agents.base import Agent
from avn.apartments.floor_plan import CELL
from avn.core.actions import HEADINGS
from avn.core.pose import FRONT, RIGHT, turned
from avn.mapping.base import Mapper
from avn.navigation.simulator import Simulator, drawn_realisations
from avn.navigation.trace import BeliefTrace, Trace

if TYPE_CHECKING:
    from tensordict import TensorDict

# Squares beyond the outermost cells in the drawn part of a map.
MARGIN = 2


class Recorder:
    """Callback of rollouts, `avn.agents.rollout.Watch`, that records traces of some episodes.

    Parameters
    ----------
    rows : mapping of str to sequence of int
        Rows of the episodes in the batch of each scene, by name of the scene.
    realisations : int
        Number of realisations of each clip.
    beliefs : bool
        True to record the beliefs of agents with maps.
    """

    def __init__(self, rows: Mapping[str, Sequence[int]], realisations: int, beliefs: bool) -> None:
        self._rows = {scene: torch.as_tensor(list(own)).long() for scene, own in rows.items()}
        self._realisations, self._keeps_beliefs = realisations, beliefs
        self._steps: dict[str, list[dict[str, Tensor]]] = {}
        self._simulators: dict[str, tuple[Simulator, bool]] = {}
        self._frames: dict[str, _Frames] = {}

    def __call__(
        self, simulator: Simulator, agent: Agent, observation: TensorDict, actions: Tensor | None
    ) -> bool:
        """Record one step of the chosen episodes, and return True if all of them are over."""
        scene = simulator.scene.name
        rows = self._rows.get(scene, torch.empty(0).long())
        if not len(rows):
            return True
        if scene not in self._simulators:
            self._simulators[scene] = simulator, agent.explores
        step = {"state": simulator.state[rows], "collided": observation["collided"][rows]}
        observed = observation.get("source_estimate", None)
        if observed is not None and observed.dim() == 2 and observed.shape[1] == 2:
            step["source_estimates"] = observed[rows]
        if actions is not None:
            step["action"] = actions[rows]
            mapper = getattr(agent, "mapper", None)
            if self._keeps_beliefs and isinstance(mapper, Mapper):
                step |= self._beliefs(simulator, mapper, rows)
                if (posterior := agent.posterior(rows)) is not None:
                    step["posterior"] = self._frames[scene].squares(posterior, outside=0.0)
        self._steps.setdefault(scene, []).append({key: x.clone() for key, x in step.items()})
        return bool(simulator.done[rows].all())

    def _beliefs(self, simulator: Simulator, mapper: Mapper, rows: Tensor) -> dict[str, Tensor]:
        """Return the beliefs of a mapper in the frame of the apartment."""
        scene = simulator.scene.name
        if scene not in self._frames:
            self._frames[scene] = _Frames(simulator, mapper, rows)
        frames = self._frames[scene]
        found = {"pose": frames.place(mapper, rows)}
        if (belief := mapper.belief(rows)) is not None:
            found["free"] = frames.squares(belief)
        if mapper.retrieved is not None:
            similarity, places = mapper.retrieved
            found |= {"similarity": similarity[rows], "retrieved": frames.entries(places[rows])}
        return found

    def trace(self, scene: str, row: int, record: Mapping[str, Any]) -> Trace:
        """Assemble the trace of an episode that has ended.

        Parameters
        ----------
        scene : str
            Name of the scene.
        row : int
            Row of the episode in the batch of the scene.
        record : mapping
            Row of `episodes.csv`.

        Returns
        -------
        Trace
        """
        simulator, explores = self._simulators[scene]
        at = self._rows[scene].tolist().index(row)
        count = int(simulator.actions[row])
        steps = self._steps[scene]

        def stacked(key: str, length: int) -> NDArray[Any] | None:
            if key not in steps[0]:
                return None
            return np.stack([step[key][at].numpy() for step in steps[:length]])

        state, estimate = stacked("state", count + 1), stacked("source_estimates", count + 1)
        episodes, pose = simulator.episodes, stacked("pose", count)
        assert state is not None
        if estimate is not None:
            offsets = turned(
                torch.from_numpy(estimate).double(), torch.from_numpy(state % HEADINGS)
            )
            estimate = simulator.scene.grid.centres[state // HEADINGS] + offsets.numpy()
        beliefs = None
        if pose is not None:
            own = [stacked(key, count) for key in ("free", "posterior", "similarity", "retrieved")]
            beliefs = BeliefTrace(pose, self._frames[scene].low, *own)
        draws = simulator.protocol.max_actions + 1
        # draws of this episode alone, since a scene may have thousands
        realisations = drawn_realisations(episodes, draws, self._realisations, [row])[
            0, : count + 1
        ]
        return Trace(
            scene=simulator.scene,
            record=record,
            sound=int(episodes.sound[row]),
            source=int(episodes.source[row]),
            state=state,
            action=np.asarray(stacked("action", count)),
            collided=np.asarray(stacked("collided", count + 1)),
            realisation=realisations.numpy().astype(np.int64),
            source_estimates=estimate,
            beliefs=beliefs,
            exploration_trajectory=episodes.trajectories[episodes.trajectory_index[row]]
            if explores
            else None,
            mix=simulator.course.of_episode(row, count, int(simulator.walked[row])),
        )


class _Frames:
    """Transforms from the map frames of R agents to the frame of the apartment."""

    def __init__(self, simulator: Simulator, mapper: Mapper, rows: Tensor) -> None:
        lattice = torch.from_numpy(np.asarray(simulator.scene.grid.lattice)).long()
        episodes, self._size = simulator.episodes, mapper.graph.cost.shape[1]
        start = simulator.start[rows]
        trajectories = torch.from_numpy(episodes.trajectories)
        begin = (
            trajectories[torch.from_numpy(episodes.trajectory_index)[rows], 0]
            if len(trajectories)
            else start
        )
        self._walk = lattice[begin // HEADINGS], begin % HEADINGS
        own = begin if mapper.in_exploration_frame else start
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
        """Return estimated poses: metres east, metres north and heading, (R, 3) float64."""
        away = turned(mapper.location[rows] - self._size // 2, self._heading)
        heading = (mapper.pose[rows, 2] + self._heading) % HEADINGS
        return torch.cat((CELL * (self._origin + away), heading[:, None].double()), dim=1)

    def squares(self, belief: Tensor, outside: float = 0.5) -> Tensor:
        """Resample beliefs (R, M, M) to the squares of the apartment, (R, H, W) uint8."""
        found = belief.flatten(1).gather(1, self._index.flatten(1)).view(self._index.shape)
        return (255 * torch.where(self._inside, found, outside)).round().to(torch.uint8)

    def entries(self, places: Tensor) -> Tensor:
        """Return memory entries (R, k, 3) as metres east, metres north and heading, float64."""
        origin, heading = self._walk
        where = CELL * (origin[:, None] + turned(places[..., :2], heading)).double()
        return torch.cat((where, ((places[..., 2:] + heading[:, None, None]) % HEADINGS)), dim=2)
