"""The shell of an apartment as triangles: floors, walls, ceilings, doorways, windows, lamps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import (
    CEILING,
    DOOR_HEIGHT,
    DOOR_WIDTH,
    WALL_THICKNESS,
    FloorPlan,
)
from avn.apartments.surfaces import BUILDING, DOOR_FRAME, PANE, Rect, _subtract_all, build_surfaces
from avn.views.decor import BORDER, DEPTH, Hanging, hangings
from avn.views.drawing import draw, to_linear
from avn.views.lights import PANE_RADIANCE, Lamps, Light, lamps_and_panes
from avn.views.mesh import Mesh, boxes, join
from avn.views.pools import COLOURS
from avn.views.textures import Pattern, outdoors, pattern

SKIRTING = 0.08
CASING = 0.07
FRAME = 0.05
# How bright a pane and a lamp look to the film: less than they shine, as to an eye that is used
# to them.
_PANE_LOOKS = 1.8
_LAMP_LOOKS = 6.0
_NEAR = 1e-6


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
class _Builder:
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


def building(plan: FloorPlan, part: str, look: int, light: Light) -> Shell:
    """Build the shell of an apartment and hang its lamps and pictures.

    Parameters
    ----------
    plan : FloorPlan
    part : {"train", "validation", "test"}
    look : int
    light : Light
    """
    surfaces = build_surfaces(plan)
    builder = _Builder()
    trim = _trim_colour(plan, part, look)
    for q in np.flatnonzero(surfaces.piece == BUILDING):
        axis, offset = int(surfaces.axis[q]), float(surfaces.offset[q])
        a0, b0, a1, b1 = (float(x) for x in (*surfaces.lower[q], *surfaces.upper[q]))
        rect = (a0, b0, a1, b1)
        material = surfaces.materials[surfaces.material[q]]
        room, normal = _side(plan, axis, offset, rect)
        if material == PANE and axis != 2:
            picture = builder.picture(outdoors, part, plan.name, look)
            _window(builder, axis, offset, rect, normal, picture, light, trim)
        elif room < 0 and material == DOOR_FRAME:
            builder.rectangle(axis, offset, rect, normal, colour=trim)
        else:
            where = "wall" if axis != 2 else "floor" if normal > 0 else "ceiling"
            key = (plan.name, max(room, 0), where, look)
            texture = builder.picture(pattern, material, part, *key)
            rects = [rect]
            if axis != 2:
                strips = _strips(plan, axis, offset, rect)
                for strip in strips:
                    builder.rectangle(axis, offset, strip, normal, colour=trim)
                rects = _subtract_all(rects, strips)
            for own in rects:
                builder.rectangle(axis, offset, own, normal, texture)
    for hanging in hangings(plan, part, look):
        _hang(builder, hanging)
    shell = builder.shell()
    if not plan.lamps:
        return shell
    lamps, _ = lamps_and_panes(plan, light)
    fixtures = _fixtures(lamps, light)
    return Shell(
        join((shell.mesh, fixtures.mesh)),
        np.concatenate((shell.glow, fixtures.glow)),
        np.concatenate((shell.shine, fixtures.shine)),
        np.concatenate((shell.shade, fixtures.shade)),
    )


def _trim_colour(plan: FloorPlan, part: str, look: int) -> NDArray[np.float64]:
    """Linear colour of skirting, door frames and windows: mostly white."""
    rng = draw("trim", part, plan.name, look)
    pool = COLOURS[part]["wood"]
    chosen = pool[0] if rng.random() < 0.6 else pool[int(rng.random() * len(pool))]
    return to_linear(np.array(chosen) / 255)


def _side(plan: FloorPlan, axis: int, offset: float, rect: Rect) -> tuple[int, float]:
    """The room before a rectangle (-1 in a doorway) and the sign of its normal."""
    centre = np.insert(((rect[0] + rect[2]) / 2, (rect[1] + rect[3]) / 2), axis, offset)
    half = WALL_THICKNESS / 2
    for sign in (1.0, -1.0):
        x, y, z = centre + sign * 0.02 * np.eye(3)[axis]
        if not 0 < z < CEILING:
            continue
        for index, r in enumerate(plan.rooms):
            if r.x0 + half < x < r.x1 - half and r.y0 + half < y < r.y1 - half:
                return index, sign
    for sign in (1.0, -1.0):
        x, y, z = centre + sign * 0.02 * np.eye(3)[axis]
        for door in plan.doorways:
            across, along = (
                (y - door.y, x - door.x) if door.along == "x" else (x - door.x, y - door.y)
            )
            if abs(across) <= half and abs(along) <= DOOR_WIDTH / 2 and 0 < z < DOOR_HEIGHT:
                if axis == 2 and sign > 0:  # the threshold has the floor of a room beside it
                    return _room_of_threshold(plan, door.x, door.y), sign
                return -1, sign
    return -1, 1.0


def _room_of_threshold(plan: FloorPlan, x: float, y: float) -> int:
    inside = [
        i
        for i, r in enumerate(plan.rooms)
        if r.x0 - _NEAR <= x <= r.x1 + _NEAR and r.y0 - _NEAR <= y <= r.y1 + _NEAR
    ]
    return inside[0]


def _strips(plan: FloorPlan, axis: int, offset: float, rect: Rect) -> list[Rect]:
    """Skirting board and door casings on a piece of wall."""
    strips: list[Rect] = []
    along = "y" if axis == 0 else "x"
    wanted: list[Rect] = []
    for door in plan.doorways:
        across, centre = (door.y, door.x) if door.along == "x" else (door.x, door.y)
        if door.along != along or abs(across - offset) > WALL_THICKNESS:
            continue
        low, high = centre - DOOR_WIDTH / 2, centre + DOOR_WIDTH / 2
        wanted += [
            (low - CASING, 0.0, low, DOOR_HEIGHT + CASING),
            (high, 0.0, high + CASING, DOOR_HEIGHT + CASING),
            (low, DOOR_HEIGHT, high, DOOR_HEIGHT + CASING),
        ]
    wanted.append((rect[0], 0.0, rect[2], SKIRTING))
    for wish in wanted:
        cut = (
            max(wish[0], rect[0]),
            max(wish[1], rect[1]),
            min(wish[2], rect[2]),
            min(wish[3], rect[3]),
        )
        if cut[2] - cut[0] > _NEAR and cut[3] - cut[1] > _NEAR:
            strips += _subtract_all([cut], strips)
    return strips


def _window(
    builder: _Builder,
    axis: int,
    offset: float,
    rect: Rect,
    normal: float,
    picture: tuple[int, Pattern],
    light: Light,
    trim: NDArray[np.float64],
) -> None:
    """Glass in a frame, with a bar in the middle of a wide one."""
    low, sill, high, top = rect
    glass = [(low + FRAME, sill + FRAME, high - FRAME, top - FRAME)]
    if high - low > 0.9:
        middle = (low + high) / 2
        glass = _subtract_all(glass, [(middle - FRAME / 2, sill, middle + FRAME / 2, top)])
    for own in _subtract_all([rect], glass):
        builder.rectangle(axis, offset, own, normal, colour=trim)
    # the whole opening counts as bright where light is worked out: the glass makes up for it
    share = _area(rect) / sum(map(_area, glass))
    for own in glass:
        builder.rectangle(
            axis,
            offset,
            own,
            normal,
            picture,
            np.full(3, 0.05),
            _PANE_LOOKS * np.sqrt(light.sky),
            share * PANE_RADIANCE * light.sky,
            whole=rect,
        )


def _area(rect: Rect) -> float:
    return (rect[2] - rect[0]) * (rect[3] - rect[1])


def _hang(builder: _Builder, hanging: Hanging) -> None:
    """A picture in its frame, which stands out from the wall a little."""
    texture = len(builder.textures), hanging.picture
    builder.textures.append(hanging.picture.picture)
    frame = to_linear(hanging.frame)
    axis, normal = hanging.axis, hanging.normal
    front = hanging.offset + normal * DEPTH
    low, sill, high, top = hanging.rect
    inner = (low + BORDER, sill + BORDER, high - BORDER, top - BORDER)
    builder.rectangle(axis, front, inner, normal, texture, whole=inner)
    for own in _subtract_all([hanging.rect], [inner]):
        builder.rectangle(axis, front, own, normal, colour=frame)
    deep = (min(hanging.offset, front), max(hanging.offset, front))
    for offset, sign in ((low, -1.0), (high, 1.0)):
        builder.rectangle(1 - axis, offset, (deep[0], sill, deep[1], top), sign, colour=frame)
    for offset, sign in ((sill, -1.0), (top, 1.0)):
        flat = (deep[0], low, deep[1], high) if axis == 0 else (low, deep[0], high, deep[1])
        builder.rectangle(2, offset, flat, sign, colour=frame)


def _fixtures(lamps: Lamps, light: Light) -> Shell:
    """A globe at each lamp and the rod that it hangs on."""
    globe = _globe(lamps.radius)
    vertices = (lamps.centre[:, None, None] + globe[None]).reshape(-1, 3, 3)
    count, several = len(vertices), len(lamps.centre)
    globes = Mesh(
        vertices=vertices.astype(np.float32),
        uv=np.zeros((count, 3, 2), dtype=np.float32),
        texture=np.full(count, -1, dtype=np.int32),
        colour=np.full((count, 3), 0.8, dtype=np.float32),
        textures=(),
        piece=np.full(count, BUILDING, dtype=np.int32),
    )
    lower = lamps.centre - (0.01, 0.01, 0.0)
    upper = np.column_stack((lamps.centre[:, :2] + 0.01, np.full(several, CEILING)))
    grey = np.full((several, 3), 0.3, dtype=np.float32)
    rods = boxes(lower, upper, grey, np.full(several, BUILDING))
    glow = np.zeros((count + len(rods), 3), dtype=np.float32)
    shine = np.zeros_like(glow)
    glow[:count] = _LAMP_LOOKS * light.lamp
    # a convex body of surface S and radiance L has the mean intensity L S / 4 (Cauchy)
    surface = np.linalg.norm(np.cross(globe[:, 1] - globe[:, 0], globe[:, 2] - globe[:, 0]), axis=1)
    radiance = 4 * lamps.intensity / (surface.sum() / 2)
    shine[:count] = np.repeat(radiance, len(globe), axis=0)
    return Shell(join((globes, rods)), glow, shine, np.zeros(len(glow), dtype=bool))


def _globe(radius: float, rings: int = 6, spokes: int = 12) -> NDArray[np.float64]:
    """Triangles (N, 3, 3) of a sphere, seen from outside counter-clockwise."""
    polar = np.linspace(0, np.pi, rings + 1)
    turn = np.linspace(0, 2 * np.pi, spokes + 1)
    point = np.stack(
        (
            np.sin(polar)[:, None] * np.cos(turn),
            np.sin(polar)[:, None] * np.sin(turn),
            np.cos(polar)[:, None] * np.ones_like(turn),
        ),
        axis=-1,
    )
    a, b = point[:-1, :-1], point[1:, :-1]
    c, d = point[1:, 1:], point[:-1, 1:]
    upper = np.stack((a, b, c), axis=2)[:-1]
    lower = np.stack((a, c, d), axis=2)[1:]  # without those that shrink to a line at the poles
    return radius * np.concatenate((upper.reshape(-1, 3, 3), lower.reshape(-1, 3, 3)))
