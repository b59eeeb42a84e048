"""Visibility of the cells of the local occupancy patch in the agent's camera."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CELL
from avn.apartments.grid import Grid
from avn.apartments.local_patch import SIDE, WINDOW
from avn.apartments.surfaces import Surfaces
from avn.apartments.walls import HEADROOM
from avn.views.camera import ray_directions
from avn.views.settings import CameraConfig

# Rays along the image side; a cell ahead of the agent is at least 3 rays wide.
RAYS = 40
# Metres by which a ray continues behind its first hit, to enter the cell of the wall it hits.
_INTO = 0.06
# Step of the march along a ray, metres.
_STRIDE = 0.05


def visible_cells(surfaces: Surfaces, grid: Grid, camera: CameraConfig) -> NDArray[np.bool_]:
    """Compute the visible cells of the local patch of every state.

    A cell is visible if part of its volume below the height of a person is in the image and not
    occluded. Objects in a cell count as part of the cell.

    Parameters
    ----------
    surfaces : Surfaces
        Surfaces of the apartment, which occlude.
    grid : Grid
        C free cells.
    camera : CameraConfig

    Returns
    -------
    (4 C, 5, 5) bool
        By state, row ahead of the agent and column.
    """
    rays = np.stack([ray_directions(camera, h, RAYS).reshape(-1, 3) for h in range(4)])
    return _seen(
        surfaces.axis,
        surfaces.offset,
        surfaces.lower,
        surfaces.upper,
        grid.centres,
        camera.height,
        rays,
    )


@numba.njit(cache=True)
def _seen(
    axis: NDArray[np.int8],
    offset: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    centres: NDArray[np.float64],
    height: float,
    rays: NDArray[np.float64],
) -> NDArray[np.bool_]:
    seen = np.zeros((4 * len(centres), WINDOW, WINDOW), dtype=np.bool_)
    reach = CELL * (WINDOW + 1) * 1.5
    for state in range(4 * len(centres)):
        cell, heading = state // 4, state % 4
        origin = np.array([centres[cell, 0], centres[cell, 1], height])
        # forward unit vector (east, north)
        fx, fy = (heading == 1) * 1.0 - (heading == 3), (heading == 0) * 1.0 - (heading == 2)
        for n in range(rays.shape[1]):
            ray = rays[heading, n]
            end = min(_hit(axis, offset, lower, upper, origin, ray), reach) + _INTO
            t = _STRIDE
            while t <= end:
                x, y, z = t * ray[0], t * ray[1], height + t * ray[2]
                row = int(np.rint((x * fx + y * fy) / CELL)) - 1
                column = int(np.rint((x * fy - y * fx) / CELL)) + SIDE
                if z < HEADROOM and 0 <= row < WINDOW and 0 <= column < WINDOW:
                    seen[state, row, column] = True
                t += _STRIDE
    return seen


@numba.njit(cache=True)
def _hit(
    axis: NDArray[np.int8],
    offset: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    origin: NDArray[np.float64],
    ray: NDArray[np.float64],
) -> float:
    """Compute the distance along a ray to the first surface in metres; infinite for none."""
    nearest = np.inf
    for q in range(len(axis)):
        a = axis[q]
        if ray[a] == 0.0:
            continue
        t = (offset[q] - origin[a]) / ray[a]
        if t <= 0.0 or t >= nearest:
            continue
        b = 1 if a == 0 else 0
        c = 1 if a == 2 else 2
        u, v = origin[b] + t * ray[b], origin[c] + t * ray[c]
        if lower[q, 0] <= u <= upper[q, 0] and lower[q, 1] <= v <= upper[q, 1]:
            nearest = t
    return nearest
