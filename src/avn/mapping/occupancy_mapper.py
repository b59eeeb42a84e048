"""`mapper=occupancy`: a map of beliefs that grows from the start on, located by odometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.core.actions import HEADINGS
from avn.core.pose import turned
from avn.mapping.base import Mapper
from avn.mapping.occupancy_map import CERTAIN, OccupancyMap
from avn.planning.partial_graph import GraphRules, PartialGraph

if TYPE_CHECKING:
    from avn.navigation.simulator import Simulator


class OccupancyMapper(Mapper):
    """Sees which squares are free, and remembers where it stood and what it ran into.

    Parameters
    ----------
    size : int
        Squares along each side of the map, odd.
    """

    needs = ("local_patch",)
    reveals = ("map",)

    def __init__(self, size: int = 101) -> None:
        self.size = size

    def reset(self, n: int, rules: GraphRules) -> None:
        """Begin N new episodes, each in the middle of an unknown map."""
        self.map = OccupancyMap(n, self.size)
        self.graph = PartialGraph(n, self.size, rules)
        self.graph.walls = self.map.walls.numpy()
        self._last = torch.zeros(n, 3, dtype=torch.int64)

    def reveal(self, part: str, simulator: Simulator) -> None:
        """Take in the true map, as seen from each start."""
        if part != "map":
            super().reveal(part, simulator)
        lattice = torch.from_numpy(simulator.place.grid.lattice).long()
        start, heading = simulator.start // HEADINGS, simulator.start % HEADINGS
        away = lattice[None] - lattice[start][:, None]
        squares = turned(away, -heading % HEADINGS)
        inside = (squares.abs() <= self.map.centre).all(dim=-1)
        squares = torch.where(inside[..., None], squares, 0)
        self.map.log_odds.fill_(-CERTAIN)
        self.map.log_odds.flatten(1).scatter_(1, self.map.flat(squares), CERTAIN)
        every = torch.arange(self.size**2).expand(len(start), -1)
        self.graph.set(every, self.map.belief.flatten(1))

    def belief(self, rows: Tensor) -> Tensor:
        """What each square is believed to be, (R, M, M)."""
        return torch.sigmoid(self.map.log_odds[rows])

    def observe(self, observation: TensorDict, way: Tensor) -> None:
        """Locate the agents by odometry and take in what they see and ran into."""
        pose = observation["odometry"]
        squares = take_in(self.map, pose, self._last, observation, way, sees=True)
        self.graph.set(squares, torch.sigmoid(self.map.log_odds.flatten(1).gather(1, squares)))
        self._last = pose
        self.pose = pose + torch.tensor([self.map.centre, self.map.centre, 0])
        self.location = self.pose[:, :2].double()


def take_in(
    beliefs: OccupancyMap,
    pose: Tensor,
    last: Tensor,
    observation: TensorDict,
    way: Tensor,
    sees: bool,
) -> Tensor:
    """Bring a map up to date with what N agents observe.

    Parameters
    ----------
    beliefs : OccupancyMap
    pose, last : (N, 3) int64 tensors
        Where the agents are now, and where they were before the last action.
    observation : TensorDict
        `collided`, and `local_patch` where it sees.
    way : (N,) int64 tensor
        See `Mapper.observe`.
    sees : bool
        Whether the map takes in which squares look free.

    Returns
    -------
    (N, k) int64 tensor
        The squares that may have changed, laid out flat.
    """
    stood = beliefs.stand(pose)
    bumped = beliefs.bump(last, (last[:, 2] + way) % 4, observation["collided"] & (way >= 0))
    squares = torch.stack((stood, bumped), dim=1)
    if sees:
        squares = torch.cat((squares, beliefs.see(pose, observation["local_patch"])), dim=1)
    return squares
