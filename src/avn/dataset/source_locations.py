"""Where the sources of an apartment lie for an agent in each of its states."""

from __future__ import annotations

import torch
from torch import Tensor

from avn.apartments.floor_plan import CELL
from avn.dataset.scene import Scene


def relative_locations(lattice: Tensor, sources: Tensor) -> Tensor:
    """Where each source lies for each state.

    Parameters
    ----------
    lattice : (C, 2) integer tensor
        Cells, in steps of the grid to the east and to the north.
    sources : (K,) integer tensor
        Cells of the sources.

    Returns
    -------
    (K, 4 C, 2) float32 tensor
        Metres to the right and to the front of an agent in state 4 x cell + heading.
    """
    east, north = ((lattice[sources][:, None] - lattice[None]) * CELL).float().unbind(-1)
    right = torch.stack((east, -north, -east, north), -1)
    front = torch.stack((north, east, -north, -east), -1)
    return torch.stack((right, front), -1).flatten(1, 2)


def where_sources_are(scene: Scene) -> tuple[Tensor, Tensor]:
    """Relative locations (K, S, 2), and whether each source is in sight (K, S), of an apartment."""
    lattice = torch.from_numpy(scene.grid.lattice.astype("int64"))
    sources = torch.from_numpy(scene.sources.astype("int64"))
    in_sight = torch.from_numpy(scene.in_sight).repeat_interleave(4, dim=1)
    return relative_locations(lattice, sources), in_sight
