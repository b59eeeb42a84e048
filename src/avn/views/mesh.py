"""Textured triangle meshes: concatenation, selection, subdivision, boxes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

BUILDING = -1


@dataclass(frozen=True)
class Mesh:
    """T textured triangles.

    Attributes
    ----------
    vertices : (T, 3, 3) float32
        Metres, x east, y north, z up.
    uv : (T, 3, 2) float32
        Texture coordinates of the vertices. Textures repeat; v points up in the image.
    texture : (T,) int32
        Index into `textures`; -1 for plain colour.
    colour : (T, 3) float32
        Linear RGB albedo, 0 to 1, which multiplies the texture.
    textures : tuple of (h, w, 3) uint8
        sRGB, row 0 at the top.
    piece : (T,) int32
        Index into `plan.furniture`; -1 for the building.
    """

    vertices: NDArray[np.float32]
    uv: NDArray[np.float32]
    texture: NDArray[np.int32]
    colour: NDArray[np.float32]
    textures: tuple[NDArray[np.uint8], ...]
    piece: NDArray[np.int32]

    def __len__(self) -> int:
        """Return the number of triangles."""
        return len(self.vertices)


def join(meshes: Sequence[Mesh]) -> Mesh:
    """Concatenate meshes."""
    starts = np.cumsum([0] + [len(mesh.textures) for mesh in meshes])
    texture = [
        np.where(mesh.texture < 0, -1, mesh.texture + start).astype(np.int32)
        for mesh, start in zip(meshes, starts, strict=False)
    ]
    return Mesh(
        vertices=np.concatenate([mesh.vertices for mesh in meshes]),
        uv=np.concatenate([mesh.uv for mesh in meshes]),
        texture=np.concatenate(texture),
        colour=np.concatenate([mesh.colour for mesh in meshes]),
        textures=tuple(picture for mesh in meshes for picture in mesh.textures),
        piece=np.concatenate([mesh.piece for mesh in meshes]),
    )


def take(mesh: Mesh, index: NDArray[np.int64] | NDArray[np.bool_]) -> Mesh:
    """Select triangles of a mesh; all its textures are kept."""
    return Mesh(
        vertices=mesh.vertices[index],
        uv=mesh.uv[index],
        texture=mesh.texture[index],
        colour=mesh.colour[index],
        textures=mesh.textures,
        piece=mesh.piece[index],
    )


def split(mesh: Mesh, longest: float) -> tuple[Mesh, NDArray[np.int64]]:
    """Bisect triangles at their longest edge until no edge exceeds a length.

    Parameters
    ----------
    mesh : Mesh
    longest : float
        Metres.

    Returns
    -------
    Mesh
        N triangles of the same surface.
    (N,) int64
        Index of the triangle of `mesh` that each is part of.
    """
    vertices, uv = mesh.vertices, mesh.uv
    parent = np.arange(len(vertices))
    while True:
        edges = np.linalg.norm(np.roll(vertices, -1, axis=1) - vertices, axis=2)
        long = edges.max(axis=1) > longest
        if not long.any():
            break
        # rotate vertices 0 and 1 to the ends of the longest edge
        turn = edges[long].round(5).argmax(axis=1)[:, None]
        order = (np.arange(3) + turn) % 3
        rows = np.arange(len(order))[:, None]
        halves = []
        for values in (vertices[long], uv[long]):
            a, b, c = np.moveaxis(values[rows, order], 1, 0)
            middle = (a + b) / 2
            halves.append(np.stack((np.stack((a, middle, c), 1), np.stack((middle, b, c), 1))))
        vertices = np.concatenate((vertices[~long], *halves[0]))
        uv = np.concatenate((uv[~long], *halves[1]))
        parent = np.concatenate((parent[~long], parent[long], parent[long]))
    order = np.argsort(parent, kind="stable")
    whole = take(mesh, parent[order])
    return (
        Mesh(vertices[order], uv[order], whole.texture, whole.colour, mesh.textures, whole.piece),
        parent[order],
    )


def boxes(
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    colour: NDArray[np.float32],
    piece: NDArray[np.int32],
) -> Mesh:
    """Build untextured axis-aligned boxes of twelve triangles each.

    Parameters
    ----------
    lower, upper : (B, 3) float64
        Opposite corners in metres.
    colour : (B, 3) float32
        Linear RGB albedo.
    piece : (B,) int32
        Index into `plan.furniture`; -1 for the building.
    """
    faces = []
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, 1):
            corners = np.zeros((4, 3), dtype=np.int64)
            corners[:, axis] = end
            corners[:, b], corners[:, c] = (0, 1, 1, 0), (0, 0, 1, 1)
            quad = corners if end else corners[::-1]
            faces += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    which = np.stack(faces)[None]  # (1, 12, 3, 3): 0 lower, 1 upper
    vertices = np.where(which, upper[:, None, None], lower[:, None, None]).reshape(-1, 3, 3)
    count = len(vertices)
    return Mesh(
        vertices=vertices.astype(np.float32),
        uv=np.zeros((count, 3, 2), dtype=np.float32),
        texture=np.full(count, -1, dtype=np.int32),
        colour=np.repeat(colour, 12, axis=0).astype(np.float32),
        textures=(),
        piece=np.repeat(piece, 12).astype(np.int32),
    )
