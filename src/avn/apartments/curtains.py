"""Curtains beside the windows of a furnished apartment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from avn.apartments.floor_plan import (
    CEILING,
    DOOR_WIDTH,
    WALL_THICKNESS,
    Doorway,
    FloorPlan,
    Piece,
    Room,
    Window,
)
from avn.apartments.furniture import CURTAIN, CURTAIN_WIDTHS, Rect
from avn.apartments.placement import DOOR_CLEARANCE, PANE_CLEARANCE, inside, overlap
from avn.core.random import Rng

# Share of the windows that have curtains, by kind of room.
CHANCE = {"bedroom": 0.95, "living_room": 0.95, "kitchen": 0.8, "bathroom": 0.0}
# Gap between the rail and the ceiling, and how far a short curtain hangs below the sill; metres.
_RAIL, _BELOW = 0.1, 0.2


def hang_curtains(plan: FloorPlan, rng: Rng) -> FloorPlan:
    """Hang an open curtain on either side of most windows, where nothing is in its way.

    A curtain is as wide as drawn if there is room, else narrower. It ends above the floor, or
    below the sill if furniture stands there, and is left out where a door would touch it.

    Parameters
    ----------
    plan : FloorPlan
        Apartment with furniture.
    rng : Generator or Draws
        Random numbers.
    """
    for window in plan.windows:
        room = next(room for room in plan.rooms if _faces(window, room))
        drawn, width = rng.random(), CURTAIN_WIDTHS[int(rng.integers(len(CURTAIN_WIDTHS)))]
        if drawn < CHANCE[room.kind]:
            for side in (-1, 1):
                fitting = (c for c in _curtains(window, room, side, width) if _is_free(c, plan))
                plan = replace(plan, furniture=(*plan.furniture, *list(fitting)[:1]))
    return plan


def _faces(window: Window, room: Room) -> bool:
    """Return True if a window is in a wall of a room."""
    low, high = (room.x0, room.x1) if window.along == "x" else (room.y0, room.y1)
    lines = (room.y0, room.y1) if window.along == "x" else (room.x0, room.x1)
    at, line = (window.x, window.y) if window.along == "x" else (window.y, window.x)
    return low < at < high and line in lines


def _floor(room: Room) -> Rect:
    half = WALL_THICKNESS / 2
    return room.x0 + half, room.y0 + half, room.x1 - half, room.y1 - half


def _curtains(window: Window, room: Room, side: int, widest: float) -> Iterator[Piece]:
    """Yield the forms of a curtain beside a window: wide before narrow, long before short."""
    x0, y0, x1, y1 = floor = _floor(room)
    first = window.y < (y0 + y1) / 2 if window.along == "x" else window.x < (x0 + x1) / 2
    for width in (w for w in CURTAIN_WIDTHS if w <= widest):
        shift, depth = side * (window.width + width) / 2, CURTAIN.depth / 2
        if window.along == "x":
            x, y = window.x + shift, y0 + depth if first else y1 - depth
            heading = 0 if first else 2
        else:
            x, y = x0 + depth if first else x1 - depth, window.y + shift
            heading = 1 if first else 3
        for z in (CURTAIN.z, window.sill - _BELOW):
            height = round(CEILING - _RAIL - z, 4)
            piece = Piece(
                CURTAIN.kind, round(x, 4), round(y, 4), width, CURTAIN.depth, height, heading,
                CURTAIN.material, round(z, 4),
            )  # fmt: skip
            if inside(piece.bounds, floor):
                yield piece


def _is_free(curtain: Piece, plan: FloorPlan) -> bool:
    """Return True if a curtain meets no furniture, no other window and no leaf of a door."""
    for piece in plan.furniture:
        bounds = piece.bounds if piece.kind != "front_door" else _before(piece)
        above = curtain.z >= piece.z + piece.height or piece.z >= curtain.z + curtain.height
        if overlap(curtain.bounds, bounds) and (piece.kind == "front_door" or not above):
            return False
    return not any(overlap(curtain.bounds, rect) for rect in (*_panes(plan), *_leaves(plan)))


def _before(door: Piece) -> Rect:
    """Return the floor that the leaf of a front door sweeps, with the door itself."""
    x0, y0, x1, y1 = door.bounds
    reach = DOOR_CLEARANCE
    return (
        x0 - reach * (door.heading == 3),
        y0 - reach * (door.heading == 2),
        x1 + reach * (door.heading == 1),
        y1 + reach * (door.heading == 0),
    )


def _strip(opening: Doorway | Window, half: float, reach: float) -> Rect:
    a, b = (half, reach) if opening.along == "x" else (reach, half)
    return opening.x - a, opening.y - b, opening.x + a, opening.y + b


def _panes(plan: FloorPlan) -> list[Rect]:
    reach = WALL_THICKNESS / 2 + PANE_CLEARANCE
    return [_strip(window, window.width / 2, reach) for window in plan.windows]


def _leaves(plan: FloorPlan) -> list[Rect]:
    reach = WALL_THICKNESS / 2 + DOOR_CLEARANCE
    return [_strip(door, DOOR_WIDTH / 2, reach) for door in plan.doorways]
