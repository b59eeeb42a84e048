"""Surfaces of an apartment: the axis-aligned rectangles that reflect sound and light.

The air of an apartment is a union of boxes: one for each room and one for each doorway. The
surfaces are the boundary of that union, minus openings, plus furniture, so that there are no gaps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import (
    CEILING,
    DOOR_HEIGHT,
    DOOR_WIDTH,
    WALL_THICKNESS,
    Doorway,
    FloorPlan,
    Piece,
    Room,
    Window,
)
from avn.apartments.walls import walls

__all__ = ["Surfaces", "build_surfaces", "line_of_sight", "shoebox", "walls"]

Rect = tuple[float, float, float, float]
# Axis of the normal, offset on it, bounds on the two other axes, material, piece.
Quad = tuple[int, float, Rect, str, int]

DOOR_FRAME = "wood"
PANE = "glass"
BUILDING = -1
_SLIVER = 1e-6
# Tolerance of the line parameter at the two ends of a line of sight.
_ENDS = 1e-9


@dataclass(frozen=True)
class Surfaces:
    """Q axis-aligned rectangles.

    Attributes
    ----------
    axis : (Q,) int8
        Axis of the normal: 0 x, 1 y, 2 z.
    offset : (Q,) float64
        Position of the rectangle on that axis, metres.
    lower, upper : (Q, 2) float64
        Bounds on the two other axes in ascending order of axis, metres.
    material : (Q,) int16
        Index into `materials`.
    piece : (Q,) int16
        Index of the piece of furniture; -1 for the building.
    materials : tuple of str
        Names of `avn.acoustics.materials`.
    """

    axis: NDArray[np.int8]
    offset: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    material: NDArray[np.int16]
    piece: NDArray[np.int16]
    materials: tuple[str, ...]


def _subtract(rect: Rect, hole: Rect) -> list[Rect]:
    """Subtract a hole from a rectangle (low, low, high, high): at most four rectangles."""
    a0, b0, a1, b1 = rect
    h0, i0, h1, i1 = max(a0, hole[0]), max(b0, hole[1]), min(a1, hole[2]), min(b1, hole[3])
    if h1 - h0 < _SLIVER or i1 - i0 < _SLIVER:
        return [rect]
    parts = [(a0, b0, h0, b1), (h1, b0, a1, b1), (h0, b0, h1, i0), (h0, i1, h1, b1)]
    return [(p, q, r, s) for p, q, r, s in parts if r - p > _SLIVER and s - q > _SLIVER]


def _subtract_all(rects: list[Rect], holes: list[Rect]) -> list[Rect]:
    for hole in holes:
        rects = [part for rect in rects for part in _subtract(rect, hole)]
    return rects


def _interior(room: Room) -> Rect:
    half = WALL_THICKNESS / 2
    return room.x0 + half, room.y0 + half, room.x1 - half, room.y1 - half


def _hole(opening: Doorway | Window, wall: tuple[str, float]) -> Rect | None:
    """Return the hole of an opening in a wall (axis, offset): bounds along it and in height."""
    across, centre = (opening.y, opening.x) if opening.along == "x" else (opening.x, opening.y)
    if opening.along != wall[0] or abs(across - wall[1]) > _SLIVER:
        return None
    if isinstance(opening, Doorway):
        return centre - DOOR_WIDTH / 2, 0.0, centre + DOOR_WIDTH / 2, DOOR_HEIGHT
    half = opening.width / 2
    return centre - half, opening.sill, centre + half, opening.sill + opening.height


def _room_quads(room: Room, plan: FloorPlan) -> list[Quad]:
    x0, y0, x1, y1 = inside = _interior(room)
    quads: list[Quad] = [
        (2, 0.0, inside, room.floor, BUILDING),
        (2, CEILING, inside, room.ceiling, BUILDING),
    ]
    # Normal, offset of the face, the wall's own line, and the span of the face.
    faces = (
        (0, x0, ("y", room.x0), (y0, y1)),
        (0, x1, ("y", room.x1), (y0, y1)),
        (1, y0, ("x", room.y0), (x0, x1)),
        (1, y1, ("x", room.y1), (x0, x1)),
    )
    for axis, offset, wall, (low, high) in faces:
        face = (low, 0.0, high, CEILING)
        doors = [hole for d in plan.doorways if (hole := _hole(d, wall)) is not None]
        panes = [hole for w in plan.windows if (hole := _hole(w, wall)) is not None]
        panes = [(max(a, low), b, min(c, high), d) for a, b, c, d in panes if c > low and a < high]
        for rect in _subtract_all([face], doors + panes):
            quads.append((axis, offset, rect, room.walls, BUILDING))
        quads += [(axis, offset, pane, PANE, BUILDING) for pane in panes]
    return quads


def _doorway_quads(door: Doorway, plan: FloorPlan) -> list[Quad]:
    """Return the two jambs, the lintel and the threshold of a doorway."""
    half, thick = DOOR_WIDTH / 2, WALL_THICKNESS / 2
    jamb_axis = 0 if door.along == "x" else 1
    centre, line = (door.x, door.y) if door.along == "x" else (door.y, door.x)
    jamb = (line - thick, 0.0, line + thick, DOOR_HEIGHT)
    low, high = centre - half, centre + half
    flat = (low, line - thick, high, line + thick)
    if door.along == "y":
        flat = (flat[1], flat[0], flat[3], flat[2])
    floor = next(
        r.floor
        for r in plan.rooms
        if r.x0 - _SLIVER <= door.x <= r.x1 + _SLIVER and r.y0 - _SLIVER <= door.y <= r.y1 + _SLIVER
    )
    return [
        (jamb_axis, low, jamb, DOOR_FRAME, BUILDING),
        (jamb_axis, high, jamb, DOOR_FRAME, BUILDING),
        (2, DOOR_HEIGHT, flat, DOOR_FRAME, BUILDING),
        (2, 0.0, flat, floor, BUILDING),
    ]


Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def _box(piece: Piece) -> Box:
    x0, y0, x1, y1 = piece.bounds
    return (x0, y0, piece.z), (x1, y1, piece.z + piece.height)


def _others(axis: int) -> tuple[int, int]:
    return (1, 2) if axis == 0 else (0, 2) if axis == 1 else (0, 1)


def _side(box: Box, axis: int) -> Rect:
    a, b = _others(axis)
    return box[0][a], box[0][b], box[1][a], box[1][b]


def _furniture_quads(plan: FloorPlan) -> list[Quad]:
    """Return the faces of all pieces, minus parts covered by walls, the floor or other pieces."""
    boxes = [_box(piece) for piece in plan.furniture]
    rooms: list[Box] = []
    for x0, y0, x1, y1 in map(_interior, plan.rooms):
        rooms.append(((x0, y0, 0.0), (x1, y1, CEILING)))
    quads: list[Quad] = []
    for index, (piece, box) in enumerate(zip(plan.furniture, boxes, strict=True)):
        for axis in range(3):
            for end in (0, 1):
                offset, face = box[end][axis], _side(box, axis)
                # Another piece covers the face if it begins in the plane in which this one
                # ends; a wall of the room, if both end there.
                covers = [_side(o, axis) for o in boxes if abs(o[1 - end][axis] - offset) < _SLIVER]
                covers += [_side(r, axis) for r in rooms if abs(r[end][axis] - offset) < _SLIVER]
                quads += [
                    (axis, offset, rect, piece.material, index)
                    for rect in _subtract_all([face], covers)
                ]
    return quads


def _pack(quads: list[Quad]) -> Surfaces:
    materials = tuple(sorted({quad[3] for quad in quads}))
    # Rounded, so that coordinates of edges that meet are equal.
    rects = np.array([quad[2] for quad in quads], dtype=np.float64).reshape(-1, 4).round(6)
    return Surfaces(
        axis=np.array([quad[0] for quad in quads], dtype=np.int8),
        offset=np.array([quad[1] for quad in quads], dtype=np.float64).round(6),
        lower=np.ascontiguousarray(rects[:, :2]),
        upper=np.ascontiguousarray(rects[:, 2:]),
        material=np.array([materials.index(quad[3]) for quad in quads], dtype=np.int16),
        piece=np.array([quad[4] for quad in quads], dtype=np.int16),
        materials=materials,
    )


def build_surfaces(plan: FloorPlan) -> Surfaces:
    """Build all surfaces that face the inside of an apartment.

    Each face of an inner wall has the material of the room it faces; doorways have jambs, a
    lintel at 2.05 m and a threshold; windows are panes in the wall's inner face; furniture is
    boxes. The outside of the building is left out.
    """
    quads = [quad for room in plan.rooms for quad in _room_quads(room, plan)]
    quads += [quad for door in plan.doorways for quad in _doorway_quads(door, plan)]
    return _pack(quads + _furniture_quads(plan))


def shoebox(size: tuple[float, float, float], material: str) -> Surfaces:
    """Build the six inner faces of a box from the origin to `size` (x, y, z in metres)."""
    box: Box = ((0.0, 0.0, 0.0), size)
    return _pack(
        [
            (axis, box[end][axis], _side(box, axis), material, BUILDING)
            for axis in range(3)
            for end in (0, 1)
        ]
    )


@numba.njit(cache=True)
def _clear(
    axis: NDArray[np.int8],
    offset: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    origins: NDArray[np.float64],
    targets: NDArray[np.float64],
) -> NDArray[np.bool_]:
    clear = np.ones(len(origins), dtype=np.bool_)
    for n in range(len(origins)):
        for q in range(len(axis)):
            a = axis[q]
            way = targets[n, a] - origins[n, a]
            if way == 0.0:
                continue
            t = (offset[q] - origins[n, a]) / way
            if t <= _ENDS or t >= 1.0 - _ENDS:
                continue
            b = 1 if a == 0 else 0
            c = 1 if a == 2 else 2
            u = origins[n, b] + t * (targets[n, b] - origins[n, b])
            v = origins[n, c] + t * (targets[n, c] - origins[n, c])
            if lower[q, 0] <= u <= upper[q, 0] and lower[q, 1] <= v <= upper[q, 1]:
                clear[n] = False
                break
    return clear


def line_of_sight(
    surfaces: Surfaces, origins: NDArray[np.float64], targets: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Test the straight lines between pairs of points for surfaces in between.

    Parameters
    ----------
    surfaces : Surfaces
        Surfaces of the scene.
    origins, targets : (N, 3) float64
        Points x, y, z in metres. A surface that touches an end of the line does not count.

    Returns
    -------
    (N,) bool
        True where no surface crosses the line.
    """
    return np.asarray(
        _clear(
            surfaces.axis,
            surfaces.offset,
            surfaces.lower,
            surfaces.upper,
            np.ascontiguousarray(origins, dtype=np.float64),
            np.ascontiguousarray(targets, dtype=np.float64),
        )
    )
