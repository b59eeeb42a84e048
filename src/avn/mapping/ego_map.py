"""The map as an agent has it before its eyes: centred on it and turned to its heading."""

from __future__ import annotations

import numba
import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict
from torch import Tensor

from avn.core.actions import BACKWARD, HEADINGS
from avn.core.errors import UserError
from avn.core.pose import turned
from avn.mapping.occupancy_map import OccupancyMap
from avn.mapping.occupancy_mapper import take_in

WIDTH = 21


class EgoMap:
    """Occupancy maps of N agents, of which each sees the part around it.

    Parameters
    ----------
    n : int
    size : int
        Squares along each side of the maps, odd.
    width : int
        Squares along each side of the part, odd.

    Attributes
    ----------
    map : OccupancyMap
        Each in the frame of its agent's start.

    Raises
    ------
    UserError
        Where `width` is no odd number, or the map is smaller.
    """

    def __init__(self, n: int, size: int = 101, width: int = WIDTH) -> None:
        if not 1 <= width <= size or width % 2 == 0:
            raise UserError(f"baseline.map_width: {width}; give an odd number up to mapper.size")
        self.map, self.width = OccupancyMap(n, size), width
        self._last = torch.zeros(n, 3, dtype=torch.int64)
        self._offsets = offsets(width)

    def reset(self, rows: Tensor) -> None:
        """Forget all that the agents of some rows know, (N,) bool."""
        chosen = rows.nonzero()[:, 0]
        self.map.forget(chosen)
        self._last[chosen] = 0

    def keep(self, rows: Tensor) -> None:
        """Go on with some of the agents alone, by number."""
        self.map.keep(rows)
        self._last = self._last[rows]

    def observe(self, observation: TensorDict, actions: Tensor | None = None) -> Tensor:
        """Take in the newest observations, and give what is around each agent.

        Parameters
        ----------
        observation : TensorDict of batch size (N,)
            `odometry`, `collided` and `local_patch`.
        actions : (N,) int64 tensor, optional
            The last actions, without which collisions tell nothing.

        Returns
        -------
        (N, width, width) float32 tensor
            Belief that each square is free, 0.5 where nothing is known; rows are to the agent's
            front, the farthest last, columns to its right.
        """
        pose = observation["odometry"]
        if actions is None:
            way = torch.full((len(pose),), -1)
        else:
            way = torch.where(actions <= BACKWARD, 2 * actions, -1)
        take_in(self.map, pose, self._last, observation, way, sees=True)
        self._last = pose.clone()
        return around(self.map.log_odds, torch.arange(len(pose)), pose, self._offsets)

    def state_dict(self) -> dict[str, Tensor]:
        """All that goes on changing."""
        kept = self.map.state_dict() | {"last": self._last}
        return {name: value.clone() for name, value in kept.items()}

    def load_state_dict(self, kept: dict[str, Tensor]) -> None:
        """Go on where `state_dict` was taken."""
        self.map.load_state_dict(kept)
        self._last = kept["last"].clone()


def offsets(width: int) -> Tensor:
    """Squares (right, front) of the part around an agent for each heading, (4, width**2, 2)."""
    half = width // 2
    front, right = torch.meshgrid(
        torch.arange(-half, half + 1), torch.arange(-half, half + 1), indexing="ij"
    )
    each = torch.stack((right, front), dim=-1).reshape(1, -1, 2).expand(HEADINGS, -1, -1)
    return turned(each, torch.arange(HEADINGS))


def around(log_odds: Tensor, row: Tensor, pose: Tensor, squares: Tensor) -> Tensor:
    """The part of a map that is around each agent.

    Parameters
    ----------
    log_odds : (W, M, M) float32 tensor
        Maps, as those of `OccupancyMap`.
    row : (N,) int64 tensor
        Which of them each agent has.
    pose : (N, 3) int64 tensor
        Right, front and heading in its frame.
    squares : (4, width**2, 2) int64 tensor
        As `offsets` gives it.

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
    """Fill `found`, (N, width**2); a loop, since most of the work would be indices in tensors."""
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
