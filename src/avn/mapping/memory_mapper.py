"""Mapper `spatial_memory`, which localises the agent by the views of an exploration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.pose import turned
from avn.mapping.base import Mapper
from avn.mapping.frames import FrameAligner, turned_walls
from avn.mapping.occupancy_map import CERTAIN, OccupancyMap
from avn.mapping.occupancy_mapper import update_map
from avn.mapping.spatial_memory import SpatialMemory, distinct, locate
from avn.planning.partial_graph import GraphRules, PartialGraph

if TYPE_CHECKING:
    from tensordict import TensorDict

    from avn.navigation.simulator import Simulator

LOCALISATIONS = ("retrieval", "retrieval+odometry")


class MemoryMapper(Mapper):
    """Mapper with a spatial memory of the exploration trajectory and a graph of its squares.

    With "retrieval", the pose is the one that the memory returns, and the map lies in the frame of
    the exploration. With "retrieval+odometry", the map lies in the frame of the start; recognised
    views vote for the alignment of the two frames, and the map of the exploration is overlaid at
    the winning alignment.

    Parameters
    ----------
    size : int
        Squares along each side of the map, odd, 11 or more.
    top : int
        Retrieved entries that an estimate of the pose averages, 1 or more.
    localisation : {"retrieval", "retrieval+odometry"}
        Source of the pose: the spatial memory alone, or odometry since the start, with the map of
        the exploration overlaid.
    heading : {"vote", "nearest"}
        Heading of an estimate of the pose: the most frequent one among the retrieved entries, or
        that of the most similar entry.
    grows : bool
        True if memory and graph gain what the agent sees, visits and collides with after the
        exploration. False, with "retrieval" alone: they stay as they are, and the agent is at the
        node nearest to its estimated location.
    local_patches : bool
        True if the map integrates the local patches, in the exploration and afterwards.
    edges : {"consecutive", "adjacent"}
        Edges between visited squares: those the agent moved along, or those between all
        neighbours.
    sharpness : float
        Drop of the cosine similarity at which a vote falls to 1 / e, more than 0.
    confidence : float
        Votes that an alignment needs, more than 0; an identical view has one vote.

    Raises
    ------
    UserError
        If a setting is out of range.
    """

    explores = True

    def __init__(
        self,
        size: int = 101,
        top: int = 3,
        localisation: str = "retrieval+odometry",
        heading: str = "vote",
        grows: bool = True,
        local_patches: bool = False,
        edges: str = "consecutive",
        sharpness: float = 0.02,
        confidence: float = 0.5,
    ) -> None:
        if localisation not in LOCALISATIONS:
            raise UserError(f"localisation: '{localisation}' is none of {', '.join(LOCALISATIONS)}")
        if heading not in ("vote", "nearest"):
            raise UserError(f"mapper.heading: '{heading}'; give vote or nearest")
        if edges not in ("consecutive", "adjacent"):
            raise UserError(f"mapper.edges: '{edges}'; give consecutive or adjacent")
        if not (sharpness > 0 and confidence > 0):
            raise UserError("mapper.sharpness and mapper.confidence are over 0")
        self.size, self.top, self.localisation = size, top, localisation
        self.in_exploration_frame = localisation == "retrieval"
        self.edges, self.sharpness, self.confidence = edges, sharpness, confidence
        self.heading, self.grows, self.local_patches = heading, grows, local_patches
        self.needs = ("visual_embedding", "local_patch") if local_patches else ("visual_embedding",)  # type: ignore[misc]
        self.ground_truths = () if self.in_exploration_frame else ("pose",)  # type: ignore[misc]

    def unused_settings(self) -> tuple[str, ...]:
        """Return the settings of the other localisation. See `Mapper.unused_settings`."""
        return ("sharpness", "confidence") if self.in_exploration_frame else ("heading", "grows")

    def reset(self, n: int, rules: GraphRules) -> None:
        """Begin N new episodes. See `Mapper.reset`."""
        self.map = OccupancyMap(n, self.size)
        self.graph = PartialGraph(n, self.size, rules)
        self._last = torch.zeros(n, 3, dtype=torch.int64)
        self._active = torch.arange(n)
        self._memory: SpatialMemory | None = None
        self.retrieved = None

    def explore(self, trajectories: TensorDict, trajectory_index: Tensor) -> None:
        """Store views, visited squares and the edges between them. See `Mapper.explore`."""
        keys, values = distinct(trajectories["visual_embedding"], trajectories["odometry"])
        self._memory = SpatialMemory(keys, values, trajectory_index, self.top)
        self._known = self._explored_map(trajectories)
        self._walk = trajectory_index
        if self.localisation == "retrieval":
            self.map.log_odds.copy_(self._known.log_odds[trajectory_index])
            self.map.walls.copy_(self._known.walls[trajectory_index])
            self.graph.walls = self.map.walls.numpy()
            every = torch.arange(self.size**2).expand(len(trajectory_index), -1)
            self.graph.set(every, self.map.belief.flatten(1))
        else:
            self._votes = FrameAligner(len(trajectory_index), self.size, self.sharpness)
            self._overlaid = torch.zeros_like(self.map.log_odds)
            self._overlaid_walls = torch.zeros_like(self.map.walls)

    def belief(self, rows: Tensor) -> Tensor:
        """Return the probability that each square is free. See `Mapper.belief`."""
        own = self.map.log_odds[rows]
        return torch.sigmoid(
            own if self.in_exploration_frame else self._both(own, self._overlaid[rows])
        )

    def set_ground_truth(self, part: str, simulator: Simulator) -> None:
        """Fix the alignment of the frames at the true one. See `Mapper.set_ground_truth`."""
        if part != "pose" or self.localisation == "retrieval":
            super().set_ground_truth(part, simulator)
        lattice = torch.from_numpy(simulator.scene.grid.lattice).long()
        first = torch.from_numpy(simulator.episodes.trajectories[:, 0])[
            simulator.episodes.trajectory_index
        ]
        start, heading = simulator.start, first % HEADINGS
        shift = lattice[start // HEADINGS] - lattice[first // HEADINGS]
        self._votes.set(turned(shift, -heading % HEADINGS), (start - first) % HEADINGS)

    def set_active(self, active: Tensor) -> None:
        """Set for which agents the alignment is updated. See `Mapper.set_active`."""
        self._active = active.nonzero()[:, 0]

    def observe(self, observation: TensorDict, direction: Tensor) -> None:
        """Localise the agents, and update map, memory and graph. See `Mapper.observe`."""
        if self._memory is None:
            raise UserError(
                "mapper: the spatial memory has no entry, for nothing was explored; "
                "take episodes=frozen and protocol.exploration_steps=400"
            )
        if self.localisation == "retrieval":
            self._observe_by_looks(self._memory, observation, direction)
        else:
            self._observe_by_votes(self._memory, observation, direction)

    def _observe_by_looks(
        self, memory: SpatialMemory, observation: TensorDict, direction: Tensor
    ) -> None:
        similarity, poses = self.retrieved = memory.recall(observation["visual_embedding"])
        found = locate(similarity, poses)
        if self.heading == "nearest":
            found[:, 2] = poses[:, 0, 2]
        pose = found.round().long()
        if not self.grows:
            pose[:, :2] = memory.nearest(found[:, :2])
            self._place(pose, found[:, :2])
            return
        squares = update_map(self.map, pose, self._last, observation, direction, self.local_patches)
        self.graph.set(squares, torch.sigmoid(self.map.log_odds.flatten(1).gather(1, squares)))
        memory.add(observation["visual_embedding"], pose, similarity[:, 0] < 1 - 1e-4)
        self._place(pose, found[:, :2])

    def _observe_by_votes(
        self, memory: SpatialMemory, observation: TensorDict, direction: Tensor
    ) -> None:
        pose = observation["odometry"]
        squares = update_map(self.map, pose, self._last, observation, direction, self.local_patches)
        similarity, poses = self.retrieved = memory.recall(
            observation["visual_embedding"], own=False
        )
        active = self._active
        changed = self._votes.vote(pose, similarity, poses, self.confidence, active)
        if len(active) == len(pose):
            own, overlaid = self.map.log_odds, self._overlaid
        else:
            own, overlaid = self.map.log_odds[active], self._overlaid[active]
        wrong = torch.zeros(len(pose), dtype=torch.bool)
        wrong[active] = ((own <= -CERTAIN) & (overlaid >= CERTAIN)).flatten(1).any(dim=1)
        changed |= self._votes.reject(wrong)
        rows = changed.nonzero()[:, 0]
        if len(rows):
            self._lay(rows)
            every = torch.arange(self.size**2).expand(len(rows), -1)
            self._set(rows, every)
        self._set(torch.arange(len(pose)), squares)
        self.graph.walls = (self.map.walls | self._overlaid_walls).numpy()
        self._place(pose, pose[:, :2].double())

    def _place(self, pose: Tensor, location: Tensor) -> None:
        centre = self.map.centre
        self._last = pose
        self.pose = pose + torch.tensor([centre, centre, 0])
        self.location = location + centre

    def _set(self, rows: Tensor, squares: Tensor) -> None:
        """Set the costs of squares of some agents from own map and overlay together."""
        own = self.map.log_odds.flatten(1)[rows[:, None], squares]
        overlaid = self._overlaid.flatten(1)[rows[:, None], squares]
        self.graph.set(squares, torch.sigmoid(self._both(own, overlaid)), rows)

    @staticmethod
    def _both(own: Tensor, overlaid: Tensor) -> Tensor:
        return torch.where(own.abs() >= CERTAIN, own, own + overlaid)

    def _lay(self, rows: Tensor) -> None:
        """Overlay the maps of the exploration on those of some agents at the winning alignment."""
        shift, turn, known = (part[rows] for part in self._votes.best())
        side = torch.arange(self.size) - self.map.centre
        squares = torch.stack(torch.meshgrid(side, side, indexing="xy"), dim=-1).reshape(1, -1, 2)
        there = turned(squares.expand(len(rows), -1, -1), turn) + shift[:, None]
        inside = (there.abs() <= self.map.centre).all(dim=-1) & known[:, None]
        index = (there[..., 1] + self.map.centre) * self.size + there[..., 0] + self.map.centre
        index = torch.where(inside, index, 0)
        trajectory_index = self._walk[rows][:, None]
        odds = torch.where(inside, self._known.log_odds.flatten(1)[trajectory_index, index], 0.0)
        walls = torch.where(inside, self._known.walls.flatten(1)[trajectory_index, index], 0)
        shape = (len(rows), self.size, self.size)
        self._overlaid[rows] = odds.reshape(shape)
        self._overlaid_walls[rows] = turned_walls(walls, turn).reshape(shape)

    def _explored_map(self, trajectories: TensorDict) -> OccupancyMap:
        """Build the map of each trajectory in the frame of its first state."""
        count, steps = trajectories.batch_size
        known = OccupancyMap(count, self.size)
        joined = torch.zeros(count, self.size**2, HEADINGS, dtype=torch.bool)
        own, before = torch.arange(count), trajectories["odometry"][:, 0]
        for step in range(steps):
            pose = trajectories["odometry"][:, step]
            here = known.mark_visited(pose)
            if self.local_patches:
                known.integrate(pose, trajectories["local_patch"][:, step])
            moved = (pose[:, :2] != before[:, :2]).any(dim=1)
            joined[own, known.flat(before[:, :2]), pose[:, 2]] |= moved  # moves go forward alone
            joined[own, here, (pose[:, 2] + 2) % HEADINGS] |= moved
            before = pose
        if self.edges == "consecutive":
            known.walls = self._unjoined(known, joined)
        return known

    def _unjoined(self, known: OccupancyMap, joined: Tensor) -> Tensor:
        """Return walls between visited neighbours that the trajectory did not move between."""
        visited = known.visited
        walls = torch.zeros_like(known.walls)
        ways = joined.reshape(*visited.shape, HEADINGS)
        for heading, (axis, step) in enumerate(((1, -1), (2, -1), (1, 1), (2, 1))):
            both = visited & visited.roll(step, dims=axis)
            walls |= (both & ~ways[..., heading]).to(torch.uint8) << heading
        return walls
