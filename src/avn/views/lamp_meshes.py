"""Meshes of pendant lamps: a globe and the rod that it hangs on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CEILING
from avn.views.building_mesh import BuildingMesh
from avn.views.lights import Lamps, Light
from avn.views.mesh import BUILDING, Mesh, boxes, join

# Emission of a lamp as the camera records it, as exposed. It is lower than its radiance.
_EMISSION = 6.0


def lamp_meshes(lamps: Lamps, light: Light) -> BuildingMesh:
    """Build the globe and rod of each lamp."""
    globe = _globe(lamps.radius)
    vertices = (lamps.centre[:, None, None] + globe[None]).reshape(-1, 3, 3)
    count, several = len(vertices), len(lamps.centre)
    globes = Mesh(
        vertices=vertices.astype(np.float32),
        uv=np.zeros((count, 3, 2), dtype=np.float32),
        texture=np.full(count, -1, dtype=np.int32),
        colour=np.full((count, 3), 0.8, dtype=np.float32),
        textures=(),
        piece=np.full(count, BUILDING, dtype=np.int32),
    )
    lower = lamps.centre - (0.01, 0.01, 0.0)
    upper = np.column_stack((lamps.centre[:, :2] + 0.01, np.full(several, CEILING)))
    grey = np.full((several, 3), 0.3, dtype=np.float32)
    rods = boxes(lower, upper, grey, np.full(several, BUILDING))
    emission = np.zeros((count + len(rods), 3), dtype=np.float32)
    radiance = np.zeros_like(emission)
    emission[:count] = _EMISSION * light.lamp
    # a convex body of surface S and radiance L has the mean intensity L S / 4 (Cauchy)
    surface = np.linalg.norm(np.cross(globe[:, 1] - globe[:, 0], globe[:, 2] - globe[:, 0]), axis=1)
    lamp_radiance = 4 * lamps.intensity / (surface.sum() / 2)
    radiance[:count] = np.repeat(lamp_radiance, len(globe), axis=0)
    return BuildingMesh(
        join((globes, rods)), emission, radiance, np.zeros(len(emission), dtype=bool)
    )


def _globe(radius: float, rings: int = 6, spokes: int = 12) -> NDArray[np.float64]:
    """Triangulate a sphere (N, 3, 3), counter-clockwise seen from outside."""
    polar = np.linspace(0, np.pi, rings + 1)
    turn = np.linspace(0, 2 * np.pi, spokes + 1)
    point = np.stack(
        (
            np.sin(polar)[:, None] * np.cos(turn),
            np.sin(polar)[:, None] * np.sin(turn),
            np.cos(polar)[:, None] * np.ones_like(turn),
        ),
        axis=-1,
    )
    a, b = point[:-1, :-1], point[1:, :-1]
    c, d = point[1:, 1:], point[:-1, 1:]
    upper = np.stack((a, b, c), axis=2)[:-1]
    lower = np.stack((a, c, d), axis=2)[1:]  # without the degenerate ones at the poles
    return radius * np.concatenate((upper.reshape(-1, 3, 3), lower.reshape(-1, 3, 3)))
