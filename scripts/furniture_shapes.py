"""Processing of a furniture model's triangles.

Read by `extract_furniture.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from furniture_entries import Slab, Source
from numpy.typing import NDArray

# Linear colour, and the picture that takes its place.
Look = tuple[tuple[float, float, float], Path | None]


@dataclass
class Shape:
    """Triangles while they are worked on; `look` indexes (colour, picture path) pairs."""

    vertices: NDArray[np.float64]
    uv: NDArray[np.float64]
    look: NDArray[np.int64]
    looks: list[Look]


def unit(at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale points so that each coordinate runs from 0 to 1."""
    low = at.min(axis=(0, 1))
    return (at - low) / np.maximum(at.max(axis=(0, 1)) - low, 1e-9)


def box(slab: Slab) -> Shape:
    """Build the twelve triangles of a plain box."""
    faces = []
    for axis in range(3):
        for end in (0.0, 1.0):
            quad = np.zeros((4, 3))
            quad[:, axis] = end
            quad[:, (axis + 1) % 3], quad[:, (axis + 2) % 3] = (0, 1, 1, 0), (0, 0, 1, 1)
            faces += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    corners = np.stack(faces)
    return Shape(corners, np.zeros((12, 3, 2)), np.zeros(12, np.int64), [(slab.colour, None)])


def bent(part: Source, shape: Shape) -> Shape:
    """Map the extents of a shape as `part.bend` says."""
    at = shape.vertices.copy()
    for axis, knots in part.bend.items():
        given, wanted = np.array(knots, dtype=float).T
        column = "uvw".index(axis)
        at[..., column] = np.interp(at[..., column], given, wanted)
    return Shape(unit(at), shape.uv, shape.look, shape.looks)


def cut_down(shape: Shape, size: tuple[float, float, float], most: int) -> Shape:
    """Merge corners that lie in the same small cube until few enough triangles are left.

    Vertex clustering (Rossignac and Borrel, "Multi-resolution 3D approximations for rendering
    complex scenes", 1993), each cluster at the mean of its corners.
    """
    metres = shape.vertices * np.array(size)
    edge = 0.002
    kept, at = with_area(metres), metres
    while kept.sum() > most:
        cube = np.floor(metres.reshape(-1, 3) / edge).astype(np.int64)
        _, member, count = np.unique(cube, axis=0, return_inverse=True, return_counts=True)
        member = member.reshape(-1)
        mean = np.stack(
            [np.bincount(member, metres.reshape(-1, 3)[:, i]) / count for i in range(3)], axis=-1
        )
        at = mean[member].reshape(metres.shape)
        kept = with_area(at)
        edge *= 1.2
    return Shape(unit(at[kept]), shape.uv[kept], shape.look[kept], shape.looks)


def with_area(at: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return True for triangles (metres) of an area that a picture can show."""
    normal = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
    area: NDArray[np.bool_] = np.linalg.norm(normal, axis=-1) > 1e-9
    return area
