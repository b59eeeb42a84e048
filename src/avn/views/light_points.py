"""Where light is gathered: one point for triangles that lie close and face the same way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.views.mesh import BUILDING, Mesh

# Lift-off of rays from their surface, metres.
LIFT = 1e-3


@dataclass(frozen=True)
class Points:
    """Where light is gathered, and which triangles are lit from there.

    Attributes
    ----------
    place, normal : (P, 3) float32
        The first `fronts` stand before front faces, the others behind back faces.
    fronts : int
    front : (T,) int32
        Point of each triangle's front face.
    back : (T,) int32
        Point of its back face; -1 for the building, whose back is never seen.
    corner : (T, 3) int32
        Number of the corner: triangles that share it and face the same way have it in common.
    """

    place: NDArray[np.float32]
    normal: NDArray[np.float32]
    front: NDArray[np.int32]
    back: NDArray[np.int32]
    corner: NDArray[np.int32]


def _numbered(*columns: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First row and number of each distinct row of some columns."""
    key = np.zeros(len(columns[0]), dtype=np.uint64)
    for column in columns:
        key = (key ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    return first, number


def _first(
    number: NDArray[np.int64], rank: NDArray[np.float64], area: NDArray[np.float32]
) -> NDArray[np.int64]:
    """Of each group the triangle of least rank, and of those the largest.

    Models hide sheets close under others: what stands out farthest is what is seen.
    """
    order = np.lexsort((-area, rank, number))
    return order[np.flatnonzero(np.diff(number[order], prepend=-1))]


def normals_of(vertices: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Unit normals (T, 3) and areas (T,) of triangles; those without an area look up."""
    v = vertices.astype(np.float64)
    cross = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    length = np.linalg.norm(cross, axis=1)
    flat = length < 1e-14
    normal = np.where(flat[:, None], (0.0, 0.0, 1.0), cross / np.where(flat, 1.0, length)[:, None])
    return normal.astype(np.float32), (length / 2).astype(np.float32)


def choose_points(mesh: Mesh, spacing: float) -> Points:
    """Group triangles that lie within `spacing` and face the same way."""
    normal, area = normals_of(mesh.vertices)
    centre = mesh.vertices.astype(np.float64).mean(axis=1)
    facing = np.rint(normal * 2).astype(np.int64)
    # along what they have in common, or the least tilt would count with the distance to the origin
    height = (centre * facing).sum(axis=1) / np.linalg.norm(facing, axis=1)
    voxel = np.floor(centre / spacing).astype(np.int64)
    # two faces of a board are apart by its thickness only
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
    place = np.concatenate((centre[outer], centre[inmost]))
    along = np.concatenate((fronts, backs))
    corners = np.rint(mesh.vertices.reshape(-1, 3).astype(np.float64) * 1000).astype(np.int64)
    _, corner = _numbered(*corners.T, *np.repeat(facing, 3, axis=0).T)
    return Points(
        (place + LIFT * along).astype(np.float32),
        along.astype(np.float32),
        front,
        back,
        corner.reshape(-1, 3).astype(np.int32),
    )
