"""Building mesh of an apartment: floors, walls, ceilings, doorways, windows, lamps, pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CEILING, DOOR_HEIGHT, DOOR_WIDTH, WALL_THICKNESS, FloorPlan
from avn.apartments.surfaces import BUILDING, DOOR_FRAME, PANE, Rect, _subtract_all, build_surfaces
from avn.views.appearance_palettes import COLOURS
from avn.views.building_mesh import BuildingMesh, BuildingMeshBuilder
from avn.views.drawing import draw, to_linear
from avn.views.lamp_meshes import lamp_meshes
from avn.views.lights import PANE_RADIANCE, Light, lamps_and_panes
from avn.views.mesh import join
from avn.views.textures import Pattern, outdoors, pattern
from avn.views.wall_pictures import BORDER, DEPTH, WallPicture, wall_pictures

SKIRTING = 0.08
CASING = 0.07
FRAME = 0.05
# Emission of a window pane as the camera records it, as exposed. It is lower than its radiance.
_PANE_EMISSION = 1.8
_NEAR = 1e-6


def building_mesh(plan: FloorPlan, part: str, appearance_seed: int, light: Light) -> BuildingMesh:
    """Build the mesh of an apartment without its furniture.

    Parameters
    ----------
    plan : FloorPlan
    part : {"train", "validation", "test"}
        Split part, which selects the appearance palette.
    appearance_seed : int
        Seed of the random choices within the palette.
    light : Light
        Colours of lamps and sky.

    Returns
    -------
    BuildingMesh
        Surfaces of the rooms, with wall pictures and lamps.
    """
    surfaces = build_surfaces(plan)
    builder = BuildingMeshBuilder()
    trim = _trim_colour(plan, part, appearance_seed)
    for q in np.flatnonzero(surfaces.piece == BUILDING):
        axis, offset = int(surfaces.axis[q]), float(surfaces.offset[q])
        a0, b0, a1, b1 = (float(x) for x in (*surfaces.lower[q], *surfaces.upper[q]))
        rect = (a0, b0, a1, b1)
        material = surfaces.materials[surfaces.material[q]]
        room, normal = _side(plan, axis, offset, rect)
        if material == PANE and axis != 2:
            picture = builder.picture(outdoors, part, plan.name, appearance_seed)
            _window(builder, axis, offset, rect, normal, picture, light, trim)
        elif room < 0 and material == DOOR_FRAME:
            builder.rectangle(axis, offset, rect, normal, colour=trim)
        else:
            where = "wall" if axis != 2 else "floor" if normal > 0 else "ceiling"
            key = (plan.name, max(room, 0), where, appearance_seed)
            texture = builder.picture(pattern, material, part, *key)
            rects = [rect]
            if axis != 2:
                strips = _strips(plan, axis, offset, rect)
                for strip in strips:
                    builder.rectangle(axis, offset, strip, normal, colour=trim)
                rects = _subtract_all(rects, strips)
            for own in rects:
                builder.rectangle(axis, offset, own, normal, texture)
    for wall_picture in wall_pictures(plan, part, appearance_seed):
        _hang(builder, wall_picture)
    built = builder.build()
    if not plan.lamps:
        return built
    lamps, _ = lamps_and_panes(plan, light)
    hung = lamp_meshes(lamps, light)
    return BuildingMesh(
        join((built.mesh, hung.mesh)),
        np.concatenate((built.emission, hung.emission)),
        np.concatenate((built.radiance, hung.radiance)),
        np.concatenate((built.occluder, hung.occluder)),
    )


def _trim_colour(plan: FloorPlan, part: str, appearance_seed: int) -> NDArray[np.float64]:
    """Draw the linear RGB colour of skirting boards, door frames and window frames."""
    rng = draw("trim", part, plan.name, appearance_seed)
    palette = COLOURS[part]["wood"]
    chosen = palette[0] if rng.random() < 0.6 else palette[int(rng.random() * len(palette))]
    return to_linear(np.array(chosen) / 255)


def _side(plan: FloorPlan, axis: int, offset: float, rect: Rect) -> tuple[int, float]:
    """Find the room that a rectangle faces (-1 in a doorway) and the sign of its normal."""
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
                if axis == 2 and sign > 0:  # the threshold gets the floor of an adjacent room
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
    """Compute the rectangles of skirting board and door casings on a piece of wall."""
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
    builder: BuildingMeshBuilder,
    axis: int,
    offset: float,
    rect: Rect,
    normal: float,
    picture: tuple[int, Pattern],
    light: Light,
    trim: NDArray[np.float64],
) -> None:
    """Add the glass and frame of a window, with a central bar if it is wide."""
    low, sill, high, top = rect
    glass = [(low + FRAME, sill + FRAME, high - FRAME, top - FRAME)]
    if high - low > 0.9:
        middle = (low + high) / 2
        glass = _subtract_all(glass, [(middle - FRAME / 2, sill, middle + FRAME / 2, top)])
    for own in _subtract_all([rect], glass):
        builder.rectangle(axis, offset, own, normal, colour=trim)
    # Baked light treats the whole opening as luminous, so the glass radiance is scaled up.
    share = _area(rect) / sum(map(_area, glass))
    for own in glass:
        builder.rectangle(
            axis,
            offset,
            own,
            normal,
            picture,
            np.full(3, 0.05),
            _PANE_EMISSION * np.sqrt(light.sky),
            share * PANE_RADIANCE * light.sky,
            whole=rect,
        )


def _area(rect: Rect) -> float:
    return (rect[2] - rect[0]) * (rect[3] - rect[1])


def _hang(builder: BuildingMeshBuilder, wall_picture: WallPicture) -> None:
    """Add a picture and its frame, which project from the wall by `DEPTH`."""
    texture = len(builder.textures), wall_picture.picture
    builder.textures.append(wall_picture.picture.picture)
    frame = to_linear(wall_picture.frame)
    axis, normal = wall_picture.axis, wall_picture.normal
    front = wall_picture.offset + normal * DEPTH
    low, sill, high, top = wall_picture.rect
    inner = (low + BORDER, sill + BORDER, high - BORDER, top - BORDER)
    builder.rectangle(axis, front, inner, normal, texture, whole=inner)
    for own in _subtract_all([wall_picture.rect], [inner]):
        builder.rectangle(axis, front, own, normal, colour=frame)
    deep = (min(wall_picture.offset, front), max(wall_picture.offset, front))
    for offset, sign in ((low, -1.0), (high, 1.0)):
        builder.rectangle(1 - axis, offset, (deep[0], sill, deep[1], top), sign, colour=frame)
    for offset, sign in ((sill, -1.0), (top, 1.0)):
        flat = (deep[0], low, deep[1], high) if axis == 0 else (low, deep[0], high, deep[1])
        builder.rectangle(2, offset, flat, sign, colour=frame)
