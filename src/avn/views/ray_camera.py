"""Ray-casting camera: the first hits of its rays, and depth images."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from avn.views.camera import ray_directions
from avn.views.rays import Hits, Triangles
from avn.views.settings import CameraConfig


class RayCamera:
    """Camera that casts rays at triangles.

    Parameters
    ----------
    camera : CameraConfig
    triangles : Triangles
    samples : int
        Rays along each side of a pixel.

    Attributes
    ----------
    rays : list of (size * size * samples^2, 3) float32
        Unit ray directions of each heading, pixel by pixel.
    pixel : float
        Width of a sample's part of the image plane at unit distance.
    """

    def __init__(self, camera: CameraConfig, triangles: Triangles, samples: int = 1) -> None:
        self.camera = camera
        self._triangles = triangles
        self.rays = [self._directions(heading, samples) for heading in range(4)]
        self._centre_rays = [self._directions(heading, 1) for heading in range(4)]
        self._axes = [ray_directions(camera, heading, 1)[0, 0, 0] for heading in range(4)]
        self.pixel = 2 * math.tan(math.radians(camera.fov) / 2) / camera.size / samples

    def _directions(self, heading: int, samples: int) -> NDArray[np.float32]:
        rays = ray_directions(self.camera, heading, self.camera.size, samples)
        return np.ascontiguousarray(rays.reshape(-1, 3).astype(np.float32))

    def _hits(self, centre: NDArray[np.float64], rays: NDArray[np.float32]) -> Hits:
        place = np.array((*centre, self.camera.height), dtype=np.float32)
        return self._triangles.intersect(np.tile(place, (len(rays), 1)), rays)

    def cast(self, centre: NDArray[np.float64], heading: int) -> Hits:
        """Return the first hits of `rays[heading]` from a position (x, y) in metres."""
        return self._hits(centre, self.rays[heading])

    def depth(self, centre: NDArray[np.float64], heading: int) -> NDArray[np.float16]:
        """Return the depth image (size, size) in metres along the optical axis; 0 for no hit."""
        rays = self._centre_rays[heading]
        hits = self._hits(centre, rays)
        along = hits.distance * (rays @ self._axes[heading])
        found = np.where(hits.triangle < 0, 0.0, along).astype(np.float16)
        return found.reshape(self.camera.size, self.camera.size)
