"""Ray casting with Embree: nearest hits and occlusion tests against triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray


@dataclass(frozen=True)
class Hits:
    """First hits of N rays.

    Attributes
    ----------
    triangle : (N,) int32
        Index of the triangle; -1 for no hit.
    u, v : (N,) float32
        Barycentric coordinates: weights of the triangle's second and third vertex.
    distance : (N,) float32
        Distance along the ray in metres.
    """

    triangle: NDArray[np.int32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    distance: NDArray[np.float32]


class Triangles:
    """Acceleration structure of triangles for ray queries.

    Parameters
    ----------
    vertices : (T, 3, 3) float32
        Metres.
    """

    def __init__(self, vertices: NDArray[np.float32]) -> None:
        self._scene = EmbreeScene(robust=True)  # else rays slip through shared edges
        self._mesh = TriangleMesh(self._scene, np.ascontiguousarray(vertices, dtype=np.float32))

    def intersect(self, origins: NDArray[np.float32], directions: NDArray[np.float32]) -> Hits:
        """Find the nearest triangle along each ray.

        Parameters
        ----------
        origins : (N, 3) float32
            Metres.
        directions : (N, 3) float32
            Unit vectors.
        """
        found = self._scene.run(origins, directions, output=1)
        return Hits(found["primID"], found["u"], found["v"], found["tfar"])

    def occluded(
        self,
        origins: NDArray[np.float32],
        directions: NDArray[np.float32],
        distances: NDArray[np.float32],
    ) -> NDArray[np.bool_]:
        """Test for occlusion along each ray.

        Parameters
        ----------
        origins : (N, 3) float32
            Metres.
        directions : (N, 3) float32
            Unit vectors.
        distances : (N,) float32
            Length of each ray in metres.

        Returns
        -------
        (N,) bool
            True if a triangle is nearer than the ray's length.
        """
        occluded: NDArray[np.bool_] = (
            self._scene.run(origins, directions, distances, query="OCCLUDED") >= 0
        )
        return occluded
