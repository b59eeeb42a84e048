"""Egocentric maps: occupancy maps centred on the agent and turned to its heading."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.core.actions import BACKWARD, HEADINGS
from avn.core.errors import UserError
from avn.core.pose import turned
from avn.mapping.occupancy_map import OccupancyMap
from avn.mapping.occupancy_mapper import update_map

if TYPE_CHECKING:
    from tensordict import TensorDict

WIDTH = 21


class EgoMap:
    """Occupancy maps of N agents, and the egocentric part of each.

    Parameters
    ----------
    n : int
        Number of agents.
    size : int
        Squares along each side of the maps, odd.
    width : int
        Squares along each side of the egocentric part, odd.

    Attributes
    ----------
    map : OccupancyMap
        Maps in the frames of the agents' starts.

    Raises
    ------
    UserError
        If `width` is even or more than `size`.
    """

    def __init__(self, n: int, size: int = 101, width: int = WIDTH) -> None:
        if not 1 <= width <= size or width % 2 == 0:
            raise UserError(f"baseline.map_width: {width}; give an odd number up to mapper.size")
        self.map, self.width = OccupancyMap(n, size), width
        self._last = torch.zeros(n, 3, dtype=torch.int64)
        self._offsets = offsets(width)

    def reset(self, rows: Tensor) -> None:
        """Clear the maps of some rows, (N,) bool."""
        chosen = rows.nonzero()[:, 0]
        self.map.forget(chosen)
        self._last[chosen] = 0

    def keep(self, rows: Tensor) -> None:
        """Keep the maps of the agents with the given numbers alone."""
        self.map.keep(rows)
        self._last = self._last[rows]

    def observe(self, observation: TensorDict, actions: Tensor | None = None) -> Tensor:
        """Update the maps with the newest observations, and return the part around each agent.

        Parameters
        ----------
        observation : TensorDict of batch size (N,)
            `odometry`, `collided` and `local_patch`.
        actions : (N,) int64 tensor, optional
            Last actions; without them collisions are ignored.

        Returns
        -------
        (N, width, width) float32 tensor
            Probability that each square is free, 0.5 if unknown. Rows go from the back to the
            front of the agent, columns from its left to its right.
        """
        pose = observation["odometry"]
        if actions is None:
            direction = torch.full((len(pose),), -1)
        else:
            direction = torch.where(actions <= BACKWARD, 2 * actions, -1)
        update_map(self.map, pose, self._last, observation, direction, sees=True)
        self._last = pose.clone()
        return around(self.map.log_odds, torch.arange(len(pose)), pose, self._offsets)

    def state_dict(self) -> dict[str, Tensor]:
        """Return copies of the maps and the last poses."""
        kept = self.map.state_dict() | {"last": self._last}
        return {name: value.clone() for name, value in kept.items()}

    def load_state_dict(self, kept: dict[str, Tensor]) -> None:
        """Restore what `state_dict` returned."""
        self.map.load_state_dict(kept)
        self._last = kept["last"].clone()


def offsets(width: int) -> Tensor:
    """Return the squares (right, front) around an agent for each heading, (4, width**2, 2)."""
    half = width // 2
    front, right = torch.meshgrid(
        torch.arange(-half, half + 1), torch.arange(-half, half + 1), indexing="ij"
    )
    each = torch.stack((right, front), dim=-1).reshape(1, -1, 2).expand(HEADINGS, -1, -1)
    return turned(each, torch.arange(HEADINGS))


def around(log_odds: Tensor, row: Tensor, pose: Tensor, squares: Tensor) -> Tensor:
    """Extract the part of a map around each agent.

    Parameters
    ----------
    log_odds : (W, M, M) float32 tensor
        Maps; see `OccupancyMap`.
    row : (N,) int64 tensor
        Map of each agent.
    pose : (N, 3) int64 tensor
        Squares to the right, squares to the front and heading in the frame of the map.
    squares : (4, width**2, 2) int64 tensor
        See `offsets`.

    Returns
    -------
    (N, width, width) float32 tensor
        Probability that each square is free; 0.5 off the map.
    """
    width = round(squares.shape[1] ** 0.5)
    found = np.empty((len(row), squares.shape[1]), dtype=np.float32)
    _around(log_odds.numpy(), row.numpy(), pose.numpy(), squares.numpy(), found)
    return torch.from_numpy(found).unflatten(1, (width, width))


@numba.njit(cache=True)
def _around(
    log_odds: NDArray[np.float32],
    row: NDArray[np.int64],
    pose: NDArray[np.int64],
    squares: NDArray[np.int64],
    found: NDArray[np.float32],
) -> None:
    """Fill `found`, (N, width**2), in a loop, which needs no index tensors."""
    size = log_odds.shape[-1]
    half = size // 2
    for n in range(len(row)):
        right, front, heading = pose[n]
        own = log_odds[row[n]]
        for k in range(squares.shape[1]):
            x, y = squares[heading, k, 0] + right + half, squares[heading, k, 1] + front + half
            if 0 <= x < size and 0 <= y < size:
                found[n, k] = np.float32(1.0) / (np.float32(1.0) + np.exp(-own[y, x]))
            else:
                found[n, k] = np.float32(0.5)
