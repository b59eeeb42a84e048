"""Mapper `occupancy`, an occupancy map in the frame of the start, localised by odometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.apartments.grid import squares_of
from avn.core.actions import HEADINGS
from avn.core.errors import UserError
from avn.core.pose import turned
from avn.mapping.base import Mapper
from avn.mapping.occupancy_map import CERTAIN, OccupancyMap
from avn.planning.partial_graph import GraphRules, PartialGraph

if TYPE_CHECKING:
    from tensordict import TensorDict

    from avn.navigation.simulator import Simulator


class OccupancyMapper(Mapper):
    """Mapper that integrates local patches, visited squares and collisions.

    Parameters
    ----------
    size : int
        Squares along each side of the map, odd, 11 or more.
    rooms_above : float or None
        Probability of being part of a room below which a square blocks sound, 0 to 1: the mapper
        then maps walls apart from furniture, which sound passes over. None does not, and sound goes
        where the agent can go.

    Raises
    ------
    UserError
        If `rooms_above` is out of range.
    """

    needs: tuple[str, ...] = ("local_patch",)  # type: ignore[misc]
    ground_truths = ("map",)

    def __init__(self, size: int = 101, rooms_above: float | None = None) -> None:
        if rooms_above is not None and not 0 <= rooms_above <= 1:
            raise UserError(f"mapper.rooms_above: {rooms_above}; give 0 to 1, or null")
        self.size, self.rooms_above = size, rooms_above
        if rooms_above is not None:
            self.needs = ("local_patch", "local_rooms")

    def reset(self, n: int, rules: GraphRules) -> None:
        """Begin N new episodes, each in the middle of an unknown map. See `Mapper.reset`."""
        self.map = OccupancyMap(n, self.size)
        self.graph = PartialGraph(n, self.size, rules)
        self.graph.walls = self.map.walls.numpy()
        if self.rooms_above is not None:
            self._rooms = OccupancyMap(n, self.size)
            self.sound_graph = PartialGraph(n, self.size, GraphRules(self.rooms_above))
        self._last = torch.zeros(n, 3, dtype=torch.int64)

    def set_ground_truth(self, part: str, simulator: Simulator) -> None:
        """Set the true map in the frame of each start. See `Mapper.set_ground_truth`."""
        if part != "map":
            super().set_ground_truth(part, simulator)
        scene = simulator.scene
        self._set_true(self.map, self.graph, scene.grid.lattice, simulator)
        if self.sound_graph is not None:
            plan = getattr(scene, "plan", None)  # a drawn scene has none, and no furniture
            rooms = scene.grid.lattice if plan is None else squares_of(plan)[0]
            self._set_true(self._rooms, self.sound_graph, rooms, simulator)

    def _set_true(
        self,
        beliefs: OccupancyMap,
        graph: PartialGraph,
        lattice: NDArray[np.int32],
        simulator: Simulator,
    ) -> None:
        """Set a map and its graph to some squares (S, 2), in the frame of each start."""
        cells = torch.from_numpy(simulator.scene.grid.lattice).long()
        start, heading = simulator.start // HEADINGS, simulator.start % HEADINGS
        away = torch.from_numpy(lattice).long()[None] - cells[start][:, None]
        squares = turned(away, -heading % HEADINGS)
        inside = (squares.abs() <= beliefs.centre).all(dim=-1)
        squares = torch.where(inside[..., None], squares, 0)
        beliefs.log_odds.fill_(-CERTAIN)
        beliefs.log_odds.flatten(1).scatter_(1, beliefs.flat(squares), CERTAIN)
        every = torch.arange(self.size**2).expand(len(start), -1)
        graph.set(every, beliefs.belief.flatten(1))

    def belief(self, rows: Tensor) -> Tensor:
        """Return the probability that each square is free. See `Mapper.belief`."""
        return torch.sigmoid(self.map.log_odds[rows])

    def observe(self, observation: TensorDict, direction: Tensor) -> None:
        """Localise the agents by odometry, and update map and graph. See `Mapper.observe`."""
        pose = observation["odometry"]
        squares = update_map(self.map, pose, self._last, observation, direction, sees=True)
        self.graph.set(squares, torch.sigmoid(self.map.log_odds.flatten(1).gather(1, squares)))
        if self.sound_graph is not None:
            self._rooms.mark_visited(pose)
            seen = self._rooms.integrate(pose, observation["local_rooms"])
            inside = torch.sigmoid(self._rooms.log_odds.flatten(1).gather(1, seen))
            self.sound_graph.set(seen, inside)
        self._last = pose
        self.pose = pose + torch.tensor([self.map.centre, self.map.centre, 0])
        self.location = self.pose[:, :2].double()


def update_map(
    beliefs: OccupancyMap,
    pose: Tensor,
    last: Tensor,
    observation: TensorDict,
    direction: Tensor,
    sees: bool,
) -> Tensor:
    """Update occupancy maps with the newest observations of N agents.

    Parameters
    ----------
    beliefs : OccupancyMap
        Maps, changed in place.
    pose, last : (N, 3) int64 tensors
        Poses of the agents after and before the last action.
    observation : TensorDict
        `collided`, and `local_patch` if `sees`.
    direction : (N,) int64 tensor
        See `Mapper.observe`.
    sees : bool
        True if the maps integrate the local patches.

    Returns
    -------
    (N, k) int64 tensor
        Flat indices of the squares that may have changed.
    """
    visited = beliefs.mark_visited(pose)
    collided = beliefs.mark_collision(
        last, (last[:, 2] + direction) % 4, observation["collided"] & (direction >= 0)
    )
    squares = torch.stack((visited, collided), dim=1)
    if sees:
        squares = torch.cat((squares, beliefs.integrate(pose, observation["local_patch"])), dim=1)
    return squares
