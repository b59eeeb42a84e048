"""Meshes with their own light, and a builder that makes them from textured rectangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from avn.apartments.surfaces import BUILDING, Rect
from avn.views.mesh import Mesh
from avn.views.textures import Pattern


@dataclass(frozen=True)
class BuildingMesh:
    """T triangles of a building, which face its interior, and their own light.

    Attributes
    ----------
    mesh : Mesh
        `piece` is -1 for all triangles.
    emission : (T, 3) float32
        Linear RGB that a triangle adds to the image, as exposed; multiplied by its texture. 0
        for most triangles.
    radiance : (T, 3) float32
        Linear RGB radiance with which a triangle lights others, as in `Lamps` and `Panes`.
    occluder : (T,) bool
        True if the triangle casts shadows; lamp meshes do not.
    """

    mesh: Mesh
    emission: NDArray[np.float32]
    radiance: NDArray[np.float32]
    occluder: NDArray[np.bool_]


@dataclass
class BuildingMeshBuilder:
    """Builder of a mesh from textured rectangles.

    Attributes
    ----------
    corners : list of (4, 3) float64
        Corners of each rectangle in metres.
    uv : list of (4, 2) float64
        Texture coordinates of the corners.
    texture : list of int
        Index into `textures`; -1 for plain colour.
    colour : list of (3,) float64
        Linear RGB albedo.
    emission, radiance : list of (3,) float64
        Linear RGB; see `BuildingMesh`.
    textures : list of (h, w, 3) uint8
        sRGB images.
    known : dict
        Index and pattern of each image that `picture` has painted.
    """

    corners: list[NDArray[np.float64]] = field(default_factory=list)
    uv: list[NDArray[np.float64]] = field(default_factory=list)
    texture: list[int] = field(default_factory=list)
    colour: list[NDArray[np.float64]] = field(default_factory=list)
    emission: list[NDArray[np.float64]] = field(default_factory=list)
    radiance: list[NDArray[np.float64]] = field(default_factory=list)
    textures: list[NDArray[np.uint8]] = field(default_factory=list)
    known: dict[tuple[object, ...], tuple[int, Pattern]] = field(default_factory=dict)

    def picture(self, paint: Callable[..., Pattern], *names: object) -> tuple[int, Pattern]:
        """Return a texture's index and pattern; paint it on the first call with these names."""
        key = (paint, *names)
        if key not in self.known:
            made = paint(*names)
            self.known[key] = (len(self.textures), made)
            self.textures.append(made.picture)
        return self.known[key]

    def rectangle(
        self,
        axis: int,
        offset: float,
        rect: Rect,
        normal: float,
        texture: tuple[int, Pattern] | None = None,
        colour: NDArray[np.float64] | None = None,
        emission: NDArray[np.float64] | None = None,
        radiance: NDArray[np.float64] | None = None,
        whole: Rect | None = None,
    ) -> None:
        """Add an axis-aligned rectangle.

        Parameters
        ----------
        axis : int
            Axis of the normal: 0 x, 1 y, 2 z.
        offset : float
            Coordinate along `axis` in metres.
        rect : Rect
            Lower and upper bounds along the two other axes in metres.
        normal : float
            Sign of the normal along `axis`.
        texture : (int, Pattern), optional
            Index into `textures`, and the pattern. Without it the colour is plain.
        colour : (3,) float64, optional
            Linear RGB albedo, white by default.
        emission, radiance : (3,) float64, optional
            Linear RGB; see `BuildingMesh`. 0 by default.
        whole : Rect, optional
            Bounds in metres that the texture covers once. Without it the texture repeats.
        """
        a, b = (1, 2) if axis == 0 else (0, 2) if axis == 1 else (0, 1)
        place = np.array(
            [(rect[0], rect[1]), (rect[2], rect[1]), (rect[2], rect[3]), (rect[0], rect[3])]
        )
        corners = np.empty((4, 3))
        corners[:, axis], corners[:, a], corners[:, b] = offset, place[:, 0], place[:, 1]
        uv = np.zeros((4, 2))
        if texture is not None:
            if whole is None:
                uv = place / (texture[1].width, texture[1].height)
            else:
                uv = (place - whole[:2]) / (whole[2] - whole[0], whole[3] - whole[1])
        facing = np.cross(corners[1] - corners[0], corners[2] - corners[0])[axis]
        if facing * normal < 0:
            corners, uv = corners[::-1], uv[::-1]
        self.corners.append(corners)
        self.uv.append(uv)
        self.texture.append(-1 if texture is None else texture[0])
        self.colour.append(np.ones(3) if colour is None else colour)
        self.emission.append(np.zeros(3) if emission is None else emission)
        self.radiance.append(np.zeros(3) if radiance is None else radiance)

    def build(self) -> BuildingMesh:
        """Return the mesh of all rectangles, two triangles each."""
        corners, uv = np.stack(self.corners), np.stack(self.uv)
        count = 2 * len(corners)
        halves = np.array([[0, 1, 2], [0, 2, 3]])
        mesh = Mesh(
            vertices=corners[:, halves].reshape(-1, 3, 3).astype(np.float32),
            uv=uv[:, halves].reshape(-1, 3, 2).astype(np.float32),
            texture=np.repeat(np.array(self.texture, dtype=np.int32), 2),
            colour=np.repeat(np.stack(self.colour), 2, axis=0).astype(np.float32),
            textures=tuple(self.textures),
            piece=np.full(count, BUILDING, dtype=np.int32),
        )
        emission, radiance = (
            np.repeat(np.stack(values), 2, axis=0).astype(np.float32)
            for values in (self.emission, self.radiance)
        )
        return BuildingMesh(mesh, emission, radiance, np.ones(count, dtype=bool))
