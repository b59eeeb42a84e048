"""Compiled sums of light baking: direct light, bounces, and averages at vertices."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray


@numba.njit(cache=True)
def add(
    found: NDArray[np.float32],
    owner: NDArray[np.int32],
    light: NDArray[np.float32],
    occluded: NDArray[np.bool_],
) -> None:
    """Add the light of unoccluded rays to their points, in place.

    Parameters
    ----------
    found : (P, 3) float32
        Irradiance of the points.
    owner : (N,) int32
        Point of each ray.
    light : (N, 3) float32
        Irradiance that each ray adds.
    occluded : (N,) bool
    """
    for n in range(len(owner)):
        if not occluded[n]:
            for i in range(3):
                found[owner[n], i] += light[n, i]


@numba.njit(cache=True)
def bounce(
    hit_faces: NDArray[np.int32],
    light: NDArray[np.float32],
    albedo: NDArray[np.float32],
    front: NDArray[np.int32],
    back: NDArray[np.int32],
) -> NDArray[np.float32]:
    """Compute one bounce of indirect light.

    Parameters
    ----------
    hit_faces : (P, R) int32
        Face that each gather ray hits: 2 t front of triangle t, 2 t + 1 back, -1 no hit.
    light : (P, 3) float32
        Irradiance of the points before the bounce.
    albedo : (T, 3) float32
        Linear RGB.
    front, back : (T,) int32
        Point of each face; -1 for none.

    Returns
    -------
    (P, 3) float32
        Irradiance by reflection from diffuse surfaces.
    """
    out = np.zeros_like(light)
    for p in range(len(hit_faces)):
        for ray in range(hit_faces.shape[1]):
            face = hit_faces[p, ray]
            if face < 0:
                continue
            triangle = face // 2
            point = front[triangle] if face % 2 == 0 else back[triangle]
            if point < 0:
                continue
            for i in range(3):
                out[p, i] += albedo[triangle, i] * light[point, i]
        for i in range(3):
            out[p, i] /= hit_faces.shape[1]
    return out


@numba.njit(cache=True)
def to_corners(
    light: NDArray[np.float32],
    side: NDArray[np.int32],
    corner: NDArray[np.int32],
    weights: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Average the light of the triangles at each vertex, weighted by area.

    Parameters
    ----------
    light : (P, 3) float32
        Irradiance of the points.
    side : (T,) int32
        Point of each triangle; -1 for none.
    corner : (T, 3) int32
        Vertex indices.
    weights : (T,) float32
        Areas of the triangles in square metres.

    Returns
    -------
    (V, 3) float32
        Irradiance of the vertices; 0 without a triangle.
    """
    count = corner.max() + 1
    total = np.zeros((count, 3))
    weight = np.zeros(count)
    for t in range(len(corner)):
        if side[t] < 0:
            continue
        for k in range(3):
            c = corner[t, k]
            weight[c] += weights[t]
            for i in range(3):
                total[c, i] += weights[t] * light[side[t], i]
    out = np.zeros((count, 3), dtype=np.float32)
    for c in range(count):
        if weight[c] > 0:
            for i in range(3):
                out[c, i] = total[c, i] / weight[c]
    return out


@numba.njit(cache=True)
def smooth(
    values: NDArray[np.float32],
    side: NDArray[np.int32],
    corner: NDArray[np.int32],
    weights: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Replace each vertex value by the area-weighted mean of its triangles' means.

    Parameters
    ----------
    values : (V, 3) float32
        Irradiance of the vertices.
    side : (T,) int32
        Point of each triangle; triangles with -1 are left out.
    corner : (T, 3) int32
        Vertex indices.
    weights : (T,) float32
        Areas of the triangles in square metres.

    Returns
    -------
    (V, 3) float32
    """
    total = np.zeros(values.shape)
    weight = np.zeros(len(values))
    for t in range(len(corner)):
        if side[t] < 0:
            continue
        for i in range(3):
            mean = (values[corner[t, 0], i] + values[corner[t, 1], i] + values[corner[t, 2], i]) / 3
            for k in range(3):
                total[corner[t, k], i] += weights[t] * mean
        for k in range(3):
            weight[corner[t, k]] += weights[t]
    out = np.zeros_like(values)
    for c in range(len(values)):
        if weight[c] > 0:
            for i in range(3):
                out[c, i] = total[c, i] / weight[c]
    return out
