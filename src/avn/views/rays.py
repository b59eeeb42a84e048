"""Embree's side of it: triangles that rays can be cast at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray


@dataclass(frozen=True)
class Hits:
    """What N rays met.

    Attributes
    ----------
    triangle : (N,) int32
        -1 where a ray met nothing.
    u, v : (N,) float32
        Weights of the triangle's second and third corner.
    distance : (N,) float32
        Metres.
    """

    triangle: NDArray[np.int32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    distance: NDArray[np.float32]


class Triangles:
    """Triangles (T, 3, 3), in metres, to cast rays at."""

    def __init__(self, vertices: NDArray[np.float32]) -> None:
        self._scene = EmbreeScene(robust=True)  # or rays slip through edges that meet
        self._mesh = TriangleMesh(self._scene, np.ascontiguousarray(vertices, dtype=np.float32))

    def meet(self, origins: NDArray[np.float32], directions: NDArray[np.float32]) -> Hits:
        """The nearest triangle along each ray.

        Parameters
        ----------
        origins : (N, 3) float32
        directions : (N, 3) float32
            Unit vectors.
        """
        found = self._scene.run(origins, directions, output=1)
        return Hits(found["primID"], found["u"], found["v"], found["tfar"])

    def blocked(
        self,
        origins: NDArray[np.float32],
        directions: NDArray[np.float32],
        distances: NDArray[np.float32],
    ) -> NDArray[np.bool_]:
        """Whether anything lies nearer than `distances` (N,) along each ray."""
        blocked: NDArray[np.bool_] = (
            self._scene.run(origins, directions, distances, query="OCCLUDED") >= 0
        )
        return blocked
