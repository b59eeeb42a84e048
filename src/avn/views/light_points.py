"""Sample points of the baked light, each shared by adjacent triangles of similar orientation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.views.mesh import BUILDING, Mesh

# Offset of sample points from their surface, metres.
LIFT = 1e-3


@dataclass(frozen=True)
class Points:
    """P sample points of the baked light, and their triangles.

    Attributes
    ----------
    position : (P, 3) float32
        Metres. Points of front faces come first, then those of back faces.
    normal : (P, 3) float32
        Unit normals.
    front : (T,) int32
        Point of each triangle's front face.
    back : (T,) int32
        Point of its back face; -1 for the building, whose back is never visible.
    corner : (T, 3) int32
        Vertex indices. Triangles of similar orientation share the vertices that they have in
        common.
    """

    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    front: NDArray[np.int32]
    back: NDArray[np.int32]
    corner: NDArray[np.int32]


def _numbered(*columns: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first row of each distinct row of some columns, and the number of each row."""
    key = np.zeros(len(columns[0]), dtype=np.uint64)
    for column in columns:
        key = (key ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    return first, number


def _first(
    number: NDArray[np.int64], rank: NDArray[np.float64], area: NDArray[np.float32]
) -> NDArray[np.int64]:
    """Select from each group the triangle of least rank, and of those the largest.

    Furniture models contain layers close behind each other, of which the outermost is visible.
    """
    order = np.lexsort((-area, rank, number))
    return order[np.flatnonzero(np.diff(number[order], prepend=-1))]


def normals_of(vertices: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Compute unit normals (T, 3) and areas (T,) in square metres of triangles.

    The normal of a triangle without area is (0, 0, 1).
    """
    v = vertices.astype(np.float64)
    cross = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    length = np.linalg.norm(cross, axis=1)
    flat = length < 1e-14
    normal = np.where(flat[:, None], (0.0, 0.0, 1.0), cross / np.where(flat, 1.0, length)[:, None])
    return normal.astype(np.float32), (length / 2).astype(np.float32)


def choose_points(mesh: Mesh, spacing: float) -> Points:
    """Group triangles by position, in voxels of `spacing` metres, and by orientation."""
    normal, area = normals_of(mesh.vertices)
    centre = mesh.vertices.astype(np.float64).mean(axis=1)
    facing = np.rint(normal * 2).astype(np.int64)
    # along the rounded normal: a tilt within the group would scale with the distance to the origin
    height = (centre * facing).sum(axis=1) / np.linalg.norm(facing, axis=1)
    voxel = np.floor(centre / spacing).astype(np.int64)
    # the two faces of a board differ only by its thickness
    layer = np.floor(height / 0.01 + 0.5).astype(np.int64)
    _, number = _numbered(*voxel.T, *facing.T, layer)
    outer, inmost = (_first(number, np.rint(sign * height / 0.0002), area) for sign in (-1, 1))
    front = number.astype(np.int32)
    inner = mesh.piece != BUILDING
    sides, back_of = np.unique(number[inner], return_inverse=True)
    back = np.full(len(mesh), -1, dtype=np.int32)
    back[inner] = len(outer) + back_of
    inmost = inmost[sides]
    fronts, backs = normal[outer], -normal[inmost]
    position = np.concatenate((centre[outer], centre[inmost]))
    along = np.concatenate((fronts, backs))
    corners = np.rint(mesh.vertices.reshape(-1, 3).astype(np.float64) * 1000).astype(np.int64)
    _, corner = _numbered(*corners.T, *np.repeat(facing, 3, axis=0).T)
    return Points(
        (position + LIFT * along).astype(np.float32),
        along.astype(np.float32),
        front,
        back,
        corner.reshape(-1, 3).astype(np.int32),
    )
