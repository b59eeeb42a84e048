"""The shell of an apartment while it is being built: rectangles and the pictures on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from avn.apartments.surfaces import BUILDING, Rect
from avn.views.mesh import Mesh
from avn.views.textures import Pattern


@dataclass(frozen=True)
class Shell:
    """The building as T triangles that face the air, and its lamps.

    Attributes
    ----------
    mesh : Mesh
        `piece` is -1 throughout.
    glow : (T, 3) float32
        Light that the film gets of a triangle by itself, exposed; it multiplies the texture. 0 for
        most.
    shine : (T, 3) float32
        Radiance with which it lights others, as `Lamps` and `Panes` have it.
    shade : (T,) bool
        Whether it keeps light off others; lamps' own fixtures do not.
    """

    mesh: Mesh
    glow: NDArray[np.float32]
    shine: NDArray[np.float32]
    shade: NDArray[np.bool_]


@dataclass
class ShellBuilder:
    """Collects rectangles and the pictures on them."""

    corners: list[NDArray[np.float64]] = field(default_factory=list)
    uv: list[NDArray[np.float64]] = field(default_factory=list)
    texture: list[int] = field(default_factory=list)
    colour: list[NDArray[np.float64]] = field(default_factory=list)
    glow: list[NDArray[np.float64]] = field(default_factory=list)
    shine: list[NDArray[np.float64]] = field(default_factory=list)
    textures: list[NDArray[np.uint8]] = field(default_factory=list)
    known: dict[tuple[object, ...], tuple[int, Pattern]] = field(default_factory=dict)

    def picture(self, paint: Callable[..., Pattern], *names: object) -> tuple[int, Pattern]:
        """Number of a picture, painted the first time that it is asked for by these names."""
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
        glow: NDArray[np.float64] | None = None,
        shine: NDArray[np.float64] | None = None,
        whole: Rect | None = None,
    ) -> None:
        """Add a rectangle; `whole` is the part of the plane that the picture covers once."""
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
        self.glow.append(np.zeros(3) if glow is None else glow)
        self.shine.append(np.zeros(3) if shine is None else shine)

    def shell(self) -> Shell:
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
        glow, shine = (
            np.repeat(np.stack(values), 2, axis=0).astype(np.float32)
            for values in (self.glow, self.shine)
        )
        return Shell(mesh, glow, shine, np.ones(count, dtype=bool))
