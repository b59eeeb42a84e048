"""Checks of what stands in the rooms of a floor plan: furniture, lamps and sources.

Each check is a generator of faults in words, as in `building_checks`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from avn.apartments.building_checks import room_label
from avn.apartments.floor_plan import (
    CEILING,
    CELL,
    FURNITURE_KINDS,
    MATERIALS,
    WALL_THICKNESS,
    FloorPlan,
    Piece,
    Room,
)
from avn.apartments.grid import free_squares, squares_of, touches
from avn.apartments.walls import is_obstacle, obstacles

# Least side of a piece of furniture, metres.
THINNEST = 0.01
# Depth to which furniture may enter a wall or another piece, for rounded numbers; metres.
_ROUNDING = 1e-3


def _label(plan: FloorPlan, index: int) -> str:
    piece = plan.furniture[index]
    return f"furniture[{index}] ({piece.kind}) at ({piece.x:g}, {piece.y:g})"


def furniture_faults(plan: FloorPlan) -> Iterator[str]:
    """Yield the pieces that are unknown, in no room, too high, in each other or before a door."""
    for n, piece in enumerate(plan.furniture):
        where = _label(plan, n)
        if piece.kind not in FURNITURE_KINDS:
            yield (
                f"furniture[{n}]: kind {piece.kind!r} is not known; use the most similar one of "
                f"{', '.join(FURNITURE_KINDS)}"
            )
        if piece.material not in MATERIALS:
            yield (
                f"{where}: material {piece.material!r} is not known; use one of "
                f"{', '.join(MATERIALS)}"
            )
        if piece.heading not in (0, 1, 2, 3):
            yield (
                f"{where}: 'heading' is {piece.heading}; give 0 north, 1 east, 2 south or 3 west"
            )
        for key in ("width", "depth", "height"):
            if (size := getattr(piece, key)) < THINNEST:
                yield f"{where}: '{key}' is {size:g}; give at least {THINNEST:g} m"
        top = piece.z + piece.height
        if piece.z < 0 or top > CEILING + _ROUNDING:
            yield (
                f"{where}: reaches from {piece.z:g} to {top:g} m; z and z + height must be within "
                f"0 and {CEILING:g} m, the height of the ceiling"
            )
        if (fault := _outside_of_rooms(plan, piece)) is not None:
            yield f"{where}: {fault}"
    for m, n in combinations(range(len(plan.furniture)), 2):
        if _in_each_other(plan.furniture[m], plan.furniture[n]):
            yield f"{_label(plan, m)} and {_label(plan, n)} are in each other; move one"
    yield from _blocked_doorways(plan)


def _floor(room: Room) -> tuple[float, float, float, float]:
    half = WALL_THICKNESS / 2
    return room.x0 + half, room.y0 + half, room.x1 - half, room.y1 - half


def _outside_of_rooms(plan: FloorPlan, piece: Piece) -> str | None:
    x0, y0, x1, y1 = piece.bounds
    floors = [_floor(room) for room in plan.rooms]
    entered = [
        n for n, (a, b, c, d) in enumerate(floors) if x0 < c and a < x1 and y0 < d and b < y1
    ]
    if not entered:
        return "stands outside of every room; move it into one"
    a, b, c, d = floors[entered[0]]
    beyond = max(a - x0, b - y0, x1 - c, y1 - d)
    if beyond <= _ROUNDING:
        return None
    return (
        f"spans x {x0:g} to {x1:g}, y {y0:g} to {y1:g} and is in a wall of "
        f"{room_label(plan, entered[0])}, whose floor is x {a:g} to {c:g}, y {b:g} to {d:g}; "
        "move it or make it smaller"
    )


def _in_each_other(a: Piece, b: Piece) -> bool:
    shared = [
        min(a.bounds[2], b.bounds[2]) - max(a.bounds[0], b.bounds[0]),
        min(a.bounds[3], b.bounds[3]) - max(a.bounds[1], b.bounds[1]),
        min(a.z + a.height, b.z + b.height) - max(a.z, b.z),
    ]
    return min(shared) > _ROUNDING


def _blocked_doorways(plan: FloorPlan) -> Iterator[str]:
    """Yield the pieces that touch an agent on its way from cell to cell through a doorway."""
    pieces = [n for n, piece in enumerate(plan.furniture) if is_obstacle(piece)]
    for k, door in enumerate(plan.doorways):
        step = np.array([[0.0, CELL]] if door.along == "x" else [[CELL, 0.0]])
        at = np.array([[door.x, door.y]])
        for n in pieces:
            if touches(at - step, at + step, np.array([plan.furniture[n].bounds])).any():
                yield (
                    f"{_label(plan, n)} blocks doorways[{k}] at ({door.x:g}, {door.y:g}); move it "
                    f"{CELL + 0.2:g} m away from the doorway"
                )


def lamp_faults(plan: FloorPlan) -> Iterator[str]:
    """Yield the lamps that are in no room, above the ceiling or in furniture."""
    for n, lamp in enumerate(plan.lamps):
        where = f"lamps[{n}] at ({lamp.x:g}, {lamp.y:g})"
        floors = [_floor(room) for room in plan.rooms]
        if not any(a < lamp.x < c and b < lamp.y < d for a, b, c, d in floors):
            yield f"{where}: hangs in no room; move it into one"
        if not 0 < lamp.z < CEILING:
            yield f"{where}: 'z' is {lamp.z:g}; give a height between 0 and {CEILING:g} m"
        for m, piece in enumerate(plan.furniture):
            x0, y0, x1, y1 = piece.bounds
            within = x0 < lamp.x < x1 and y0 < lamp.y < y1
            if within and piece.z < lamp.z < piece.z + piece.height:
                yield f"{where}: is in {_label(plan, m)}; move one"


def source_faults(plan: FloorPlan) -> Iterator[str]:
    """Yield the sources that are not on free cells of their own."""
    if not plan.sources:
        yield "sources is empty; give at least one, [x, y] of a free cell"
    lattice, _ = squares_of(plan)
    boxes = obstacles(plan)
    free = {tuple(square) for square in lattice[free_squares(lattice, boxes)[0]].tolist()}
    squares = {tuple(square) for square in lattice.tolist()}
    pieces = [n for n, piece in enumerate(plan.furniture) if is_obstacle(piece)]
    for k, (x, y) in enumerate(plan.sources):
        where, square = f"sources[{k}] at ({x:g}, {y:g})", (round(x / CELL), round(y / CELL))
        at = np.array([[x, y]])
        if x % CELL or y % CELL:
            yield f"{where}: is not at the centre of a cell; give multiples of {CELL} m"
        if square not in squares:
            yield f"{where}: is on a wall or outside of every room; move it onto a free cell"
        if square not in free:
            near = [n for n in pieces if touches(at, at, np.array([plan.furniture[n].bounds]))[0]]
            thing = _label(plan, near[0]) if near else "a wall"
            yield f"{where}: is in or within 0.2 m of {thing}; move it onto a free cell"
        if plan.sources.index((x, y)) < k:
            yield f"{where}: another source is there; move one"
