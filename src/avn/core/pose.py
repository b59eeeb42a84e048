"""Poses on a map: squares to the right and to the front, and a heading in quarter turns.

A map has a frame of its own, in which heading 0 points along the second axis. A pose is
(right, front, heading) in this frame, as measured by odometry.
"""

from __future__ import annotations

import torch
from torch import Tensor

# (right, front) of one step forwards at headings 0 to 3.
FRONT = torch.tensor([(0, 1), (1, 0), (0, -1), (-1, 0)])
# (right, front) of one step to the right at headings 0 to 3.
RIGHT = FRONT.roll(-1, dims=0)


def turned(offsets: Tensor, heading: Tensor) -> Tensor:
    """Rotate offsets from the axes of an agent to those of the map.

    Parameters
    ----------
    offsets : (N, ..., 2) tensor
        To the agent's right and to its front.
    heading : (N,) int64 tensor
        Headings of the agents, 0 to 3.

    Returns
    -------
    (N, ..., 2) tensor
        Along the axes of the map, in the same unit and type.
    """
    shape = (len(heading), *(1,) * (offsets.dim() - 2), 2)
    right = RIGHT[heading].to(offsets.dtype).view(shape)
    front = FRONT[heading].to(offsets.dtype).view(shape)
    return offsets[..., :1] * right + offsets[..., 1:] * front
