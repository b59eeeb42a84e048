"""Locations of an apartment's sources relative to an agent in each state."""

from __future__ import annotations

import torch
from torch import Tensor

from avn.apartments.floor_plan import CELL
from avn.dataset.scene import Scene


def relative_locations(lattice: Tensor, sources: Tensor) -> Tensor:
    """Compute the location of each source relative to each state.

    Parameters
    ----------
    lattice : (C, 2) integer tensor
        Lattice indices of the cells, to the east and to the north.
    sources : (K,) integer tensor
        Cells of the sources.

    Returns
    -------
    (K, 4 C, 2) float32 tensor
        Metres to the right and to the front of an agent in state 4 x cell + heading.
    """
    east, north = ((lattice[sources][:, None] - lattice[None]) * CELL).float().unbind(-1)
    return to_headings(east, north)


def to_headings(east: Tensor, north: Tensor) -> Tensor:
    """Rotate offsets (K, C) to the east and north to right and front in all states, (K, 4 C, 2)."""
    right = torch.stack((east, -north, -east, north), -1)
    front = torch.stack((north, east, -north, -east), -1)
    return torch.stack((right, front), -1).flatten(1, 2)


def locate_sources(scene: Scene) -> tuple[Tensor, Tensor]:
    """Return the relative locations of sources (K, S, 2) in metres and their visibility (K, S)."""
    lattice = torch.from_numpy(scene.grid.lattice.astype("int64"))
    sources = torch.from_numpy(scene.sources.astype("int64"))
    in_sight = torch.from_numpy(scene.in_sight).repeat_interleave(4, dim=1)
    return relative_locations(lattice, sources), in_sight
