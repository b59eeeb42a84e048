"""The shell of an apartment as triangles: floors, walls, ceilings, doorways, windows, lamps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CEILING, DOOR_HEIGHT, DOOR_WIDTH, WALL_THICKNESS, FloorPlan
from avn.apartments.surfaces import BUILDING, DOOR_FRAME, PANE, Rect, _subtract_all, build_surfaces
from avn.views.decor import BORDER, DEPTH, Hanging, hangings
from avn.views.drawing import draw, to_linear
from avn.views.fixtures import fixtures
from avn.views.lights import PANE_RADIANCE, Light, lamps_and_panes
from avn.views.mesh import join
from avn.views.pools import COLOURS
from avn.views.shell import Shell, ShellBuilder
from avn.views.textures import Pattern, outdoors, pattern

SKIRTING = 0.08
CASING = 0.07
FRAME = 0.05
# How bright a pane looks to the film: less than it shines, as to an eye that is used to it.
_PANE_LOOKS = 1.8
_NEAR = 1e-6


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
    builder = ShellBuilder()
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
    hung = fixtures(lamps, light)
    return Shell(
        join((shell.mesh, hung.mesh)),
        np.concatenate((shell.glow, hung.glow)),
        np.concatenate((shell.shine, hung.shine)),
        np.concatenate((shell.shade, hung.shade)),
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
    builder: ShellBuilder,
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


def _hang(builder: ShellBuilder, hanging: Hanging) -> None:
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
