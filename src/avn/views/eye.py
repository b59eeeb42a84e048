"""What renderers share of the camera: rays to cast from a state, and depth along its axis."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from avn.views.camera import CameraConfig, ray_directions
from avn.views.rays import Hits, Triangles


class Eye:
    """A camera before triangles.

    Parameters
    ----------
    camera : CameraConfig
    triangles : Triangles
    samples : int
        Rays along each side of a pixel.

    Attributes
    ----------
    rays : list of (size * size * samples^2, 3) float32
        Of each heading, pixel by pixel.
    pixel : float
        How wide a sample's share of the picture is at a distance of 1.
    """

    def __init__(self, camera: CameraConfig, triangles: Triangles, samples: int = 1) -> None:
        self.camera = camera
        self._triangles = triangles
        self.rays = [self._fan(heading, samples) for heading in range(4)]
        self._middles = [self._fan(heading, 1) for heading in range(4)]
        self._axes = [ray_directions(camera, heading, 1)[0, 0, 0] for heading in range(4)]
        self.pixel = 2 * math.tan(math.radians(camera.fov) / 2) / camera.size / samples

    def _fan(self, heading: int, samples: int) -> NDArray[np.float32]:
        rays = ray_directions(self.camera, heading, self.camera.size, samples)
        return np.ascontiguousarray(rays.reshape(-1, 3).astype(np.float32))

    def _meet(self, centre: NDArray[np.float64], rays: NDArray[np.float32]) -> Hits:
        place = np.array((*centre, self.camera.height), dtype=np.float32)
        return self._triangles.meet(np.tile(place, (len(rays), 1)), rays)

    def look(self, centre: NDArray[np.float64], heading: int) -> Hits:
        """What `rays` of a heading meet from a place (x, y)."""
        return self._meet(centre, self.rays[heading])

    def depth(self, centre: NDArray[np.float64], heading: int) -> NDArray[np.float16]:
        """Metres along the axis to what is in the middle of each pixel, (size, size); or 0."""
        rays = self._middles[heading]
        hits = self._meet(centre, rays)
        along = hits.distance * (rays @ self._axes[heading])
        found = np.where(hits.triangle < 0, 0.0, along).astype(np.float16)
        return found.reshape(self.camera.size, self.camera.size)
