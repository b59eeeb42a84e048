"""Places on a map: squares to the right and to the front, and a heading in quarter turns.

A map has a frame of its own, in which heading 0 looks along the second axis. A pose is
(right, front, heading) in this frame, as odometry gives it.
"""

from __future__ import annotations

import torch
from torch import Tensor

# (right, front) of one step along headings 0 to 3.
FRONT = torch.tensor([(0, 1), (1, 0), (0, -1), (-1, 0)])
# (right, front) of one step to the right of somebody who faces headings 0 to 3.
RIGHT = FRONT.roll(-1, dims=0)


def turned(offsets: Tensor, heading: Tensor) -> Tensor:
    """Offsets as an agent sees them, in the axes of the map.

    Parameters
    ----------
    offsets : (N, ..., 2) tensor
        To the agent's right and to its front.
    heading : (N,) int64 tensor

    Returns
    -------
    (N, ..., 2) tensor
        Along the axes of the map, in the same unit and type.
    """
    shape = (len(heading), *(1,) * (offsets.dim() - 2), 2)
    right = RIGHT[heading].to(offsets.dtype).view(shape)
    front = FRONT[heading].to(offsets.dtype).view(shape)
    return offsets[..., :1] * right + offsets[..., 1:] * front
