"""Pinhole camera of the agent: its settings and the ray direction of each pixel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from avn.core.errors import UserError
from avn.views.settings import CameraConfig


def ray_directions(
    camera: CameraConfig, heading: int, size: int, samples: int = 1
) -> NDArray[np.float64]:
    """Compute the directions of the rays through each pixel.

    Parameters
    ----------
    camera : CameraConfig
    heading : int
        0 north, 1 east, 2 south, 3 west.
    size : int
        Image side in pixels.
    samples : int
        Rays along each side of a pixel, on a regular grid.

    Returns
    -------
    (size, size, samples ** 2, 3) float64
        Unit vectors (east, north, up). Row 0 is the top of the image, column 0 its left edge.

    Raises
    ------
    UserError
        If the field of view is not between 0 and 180 degrees.
    """
    if not 0 < camera.fov < 180:
        raise UserError(f"renderer.camera.fov: {camera.fov}; give degrees between 0 and 180")
    fine = size * samples
    steps = ((np.arange(fine) + 0.5) / fine * 2 - 1) * math.tan(math.radians(camera.fov) / 2)
    up, right = np.meshgrid(-steps, steps, indexing="ij")
    pitch = math.radians(camera.pitch)
    front = math.cos(pitch) - up * math.sin(pitch)
    z = math.sin(pitch) + up * math.cos(pitch)
    sin, cos = ((0, 1), (1, 0), (0, -1), (-1, 0))[heading]  # of the forward direction
    rays = np.stack((front * sin + right * cos, front * cos - right * sin, z), axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    blocks = rays.reshape(size, samples, size, samples, 3).transpose(0, 2, 1, 3, 4)
    return np.ascontiguousarray(blocks.reshape(size, size, samples * samples, 3))
