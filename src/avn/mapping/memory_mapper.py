"""`mapper=spatial_memory`: explores first, then finds itself by what places look like."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.pose import turned
from avn.mapping.base import Mapper
from avn.mapping.frames import FrameAligner, turned_walls
from avn.mapping.occupancy_map import CERTAIN, OccupancyMap
from avn.mapping.occupancy_mapper import take_in
from avn.mapping.spatial_memory import SpatialMemory, distinct, locate
from avn.planning.partial_graph import GraphRules, PartialGraph

if TYPE_CHECKING:
    from avn.navigation.simulator import Simulator

LOCALISATIONS = ("retrieval", "retrieval+odometry")


class MemoryMapper(Mapper):
    """Remembers a walk as pictures with their places, and as a graph of visited squares.

    While the agent seeks the source, the memory tells where it is. With "retrieval" place and
    heading are what the memory returns and nothing else: the map lies in the frame of the walk.
    With "retrieval+odometry" the map lies in the frame of the start; every picture that the
    memory recognises votes for where the walk lies in it, and the winner is laid over the map.

    Parameters
    ----------
    size : int
        Squares along each side of the map, odd.
    top : int
        Entries that an estimate of the place is made of.
    localisation : {"retrieval", "retrieval+odometry"}
        Whether it takes itself to be where the memory says, or where odometry since the start
        says, on a map over which the walk is laid.
    local_patches : bool
        Whether the map also takes in which squares look free, in the walk and later.
    edges : {"consecutive", "adjacent"}
        Whether squares of the walk are joined where the walk went from one to the other, or
        wherever they are neighbours.
    sharpness : float
        A picture that is less like an entry by this much, in cosine, has 1 / e of its vote.
    confidence : float
        Votes from which the walk is laid over the map; an equal picture has one.
    """

    explores = True

    def __init__(
        self,
        size: int = 101,
        top: int = 3,
        localisation: str = "retrieval+odometry",
        local_patches: bool = False,
        edges: str = "consecutive",
        sharpness: float = 0.02,
        confidence: float = 0.5,
    ) -> None:
        if localisation not in LOCALISATIONS:
            raise UserError(f"localisation: '{localisation}' is none of {', '.join(LOCALISATIONS)}")
        if edges not in ("consecutive", "adjacent"):
            raise UserError(f"mapper.edges: '{edges}'; give consecutive or adjacent")
        if not (sharpness > 0 and confidence > 0):
            raise UserError("mapper.sharpness and mapper.confidence are over 0")
        self.size, self.top, self.localisation = size, top, localisation
        self.in_walk = localisation == "retrieval"
        self.edges, self.sharpness, self.confidence = edges, sharpness, confidence
        self.local_patches = local_patches
        self.needs = ("visual_embedding", "local_patch") if local_patches else ("visual_embedding",)  # type: ignore[misc]
        self.reveals = () if self.in_walk else ("pose",)  # type: ignore[misc]

    def unused_settings(self) -> tuple[str, ...]:
        """Those of the votes, where it goes by what it recognises alone."""
        return ("sharpness", "confidence") if self.in_walk else ()

    def reset(self, n: int, rules: GraphRules) -> None:
        """Begin N new episodes; the walks come with `explore`."""
        self.map = OccupancyMap(n, self.size)
        self.graph = PartialGraph(n, self.size, rules)
        self._last = torch.zeros(n, 3, dtype=torch.int64)
        self._awake = torch.arange(n)
        self._memory: SpatialMemory | None = None
        self.retrieved = None

    def explore(self, walks: TensorDict, walk: Tensor) -> None:
        """Remember the walks: pictures, visited squares and the edges between them."""
        keys, values = distinct(walks["visual_embedding"], walks["odometry"])
        self._memory = SpatialMemory(keys, values, walk, self.top)
        self._known = self._walked(walks)
        self._walk = walk
        if self.localisation == "retrieval":
            self.map.log_odds.copy_(self._known.log_odds[walk])
            self.map.walls.copy_(self._known.walls[walk])
            self.graph.walls = self.map.walls.numpy()
            every = torch.arange(self.size**2).expand(len(walk), -1)
            self.graph.set(every, self.map.belief.flatten(1))
        else:
            self._votes = FrameAligner(len(walk), self.size, self.sharpness)
            self._overlaid = torch.zeros_like(self.map.log_odds)
            self._overlaid_walls = torch.zeros_like(self.map.walls)

    def belief(self, rows: Tensor) -> Tensor:
        """What each square is believed to be, (R, M, M): own map and walk together."""
        own = self.map.log_odds[rows]
        return torch.sigmoid(own if self.in_walk else self._both(own, self._overlaid[rows]))

    def reveal(self, part: str, simulator: Simulator) -> None:
        """Take in where the walk truly lies in the frame of the start."""
        if part != "pose" or self.localisation == "retrieval":
            super().reveal(part, simulator)
        lattice = torch.from_numpy(simulator.place.grid.lattice).long()
        first = torch.from_numpy(simulator.episodes.walks[:, 0])[simulator.episodes.walk]
        start, heading = simulator.start, first % HEADINGS
        shift = lattice[start // HEADINGS] - lattice[first // HEADINGS]
        self._votes.settle(turned(shift, -heading % HEADINGS), (start - first) % HEADINGS)

    def rest(self, done: Tensor) -> None:
        """Look for the walks of agents that go on alone."""
        self._awake = (~done).nonzero()[:, 0]

    def observe(self, observation: TensorDict, way: Tensor) -> None:
        """Find the agents, and bring map, memory and graph up to date."""
        if self._memory is None:
            raise UserError(
                "mapper: the spatial memory has no entry, for nothing was explored; "
                "take episodes=frozen and protocol.exploration_steps=400"
            )
        if self.localisation == "retrieval":
            self._observe_by_looks(self._memory, observation, way)
        else:
            self._observe_by_votes(self._memory, observation, way)

    def _observe_by_looks(
        self, memory: SpatialMemory, observation: TensorDict, way: Tensor
    ) -> None:
        similarity, places = self.retrieved = memory.recall(observation["visual_embedding"])
        found = locate(similarity, places)
        pose = found.round().long()
        squares = take_in(self.map, pose, self._last, observation, way, self.local_patches)
        self.graph.set(squares, torch.sigmoid(self.map.log_odds.flatten(1).gather(1, squares)))
        memory.add(observation["visual_embedding"], pose, similarity[:, 0] < 1 - 1e-4)
        self._place(pose, found[:, :2])

    def _observe_by_votes(
        self, memory: SpatialMemory, observation: TensorDict, way: Tensor
    ) -> None:
        pose = observation["odometry"]
        squares = take_in(self.map, pose, self._last, observation, way, self.local_patches)
        similarity, places = self.retrieved = memory.recall(
            observation["visual_embedding"], own=False
        )
        awake = self._awake
        changed = self._votes.vote(pose, similarity, places, self.confidence, awake)
        if len(awake) == len(pose):
            own, overlaid = self.map.log_odds, self._overlaid
        else:
            own, overlaid = self.map.log_odds[awake], self._overlaid[awake]
        wrong = torch.zeros(len(pose), dtype=torch.bool)
        wrong[awake] = ((own <= -CERTAIN) & (overlaid >= CERTAIN)).flatten(1).any(dim=1)
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
        """Give squares of some agents the cost of what walk and own map say together."""
        own = self.map.log_odds.flatten(1)[rows[:, None], squares]
        overlaid = self._overlaid.flatten(1)[rows[:, None], squares]
        self.graph.set(squares, torch.sigmoid(self._both(own, overlaid)), rows)

    @staticmethod
    def _both(own: Tensor, overlaid: Tensor) -> Tensor:
        return torch.where(own.abs() >= CERTAIN, own, own + overlaid)

    def _lay(self, rows: Tensor) -> None:
        """Lay what the walk knows over the maps of some agents, where they take it to lie."""
        shift, turn, known = (part[rows] for part in self._votes.best())
        side = torch.arange(self.size) - self.map.centre
        squares = torch.stack(torch.meshgrid(side, side, indexing="xy"), dim=-1).reshape(1, -1, 2)
        there = turned(squares.expand(len(rows), -1, -1), turn) + shift[:, None]
        inside = (there.abs() <= self.map.centre).all(dim=-1) & known[:, None]
        index = (there[..., 1] + self.map.centre) * self.size + there[..., 0] + self.map.centre
        index = torch.where(inside, index, 0)
        walk = self._walk[rows][:, None]
        odds = torch.where(inside, self._known.log_odds.flatten(1)[walk, index], 0.0)
        walls = torch.where(inside, self._known.walls.flatten(1)[walk, index], 0)
        shape = (len(rows), self.size, self.size)
        self._overlaid[rows] = odds.reshape(shape)
        self._overlaid_walls[rows] = turned_walls(walls, turn).reshape(shape)

    def _walked(self, walks: TensorDict) -> OccupancyMap:
        """What each walk knows of the squares round its start."""
        count, steps = walks.batch_size
        known = OccupancyMap(count, self.size)
        joined = torch.zeros(count, self.size**2, HEADINGS, dtype=torch.bool)
        own, before = torch.arange(count), walks["odometry"][:, 0]
        for step in range(steps):
            pose = walks["odometry"][:, step]
            here = known.stand(pose)
            if self.local_patches:
                known.see(pose, walks["local_patch"][:, step])
            moved = (pose[:, :2] != before[:, :2]).any(dim=1)
            joined[own, known.flat(before[:, :2]), pose[:, 2]] |= moved  # it only walks forward
            joined[own, here, (pose[:, 2] + 2) % HEADINGS] |= moved
            before = pose
        if self.edges == "consecutive":
            known.walls = self._unjoined(known, joined)
        return known

    def _unjoined(self, known: OccupancyMap, joined: Tensor) -> Tensor:
        """Walls between visited neighbours that the walk did not go between."""
        visited = known.visited
        walls = torch.zeros_like(known.walls)
        ways = joined.reshape(*visited.shape, HEADINGS)
        for heading, (axis, step) in enumerate(((1, -1), (2, -1), (1, 1), (2, 1))):
            both = visited & visited.roll(step, dims=axis)
            walls |= (both & ~ways[..., heading]).to(torch.uint8) << heading
        return walls
