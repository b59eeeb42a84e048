"""Checks of the building of a floor plan: rooms, doorways and windows.

Each check is a generator of faults in words. A fault names the entry of the file, such as
`windows[2]`, and says what to do.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, permutations

from avn.apartments.floor_plan import (
    CEILING,
    CELL,
    DOOR_WIDTH,
    MATERIALS,
    ROOM_KINDS,
    WALL_THICKNESS,
    Doorway,
    FloorPlan,
    Window,
)
from avn.apartments.layout import outer_spans

# Least distance between two outer walls that face each other, metres. Rooms that are closer were
# meant to share a wall.
COURTYARD = 1.5
# A room of this width, between the centre lines of its walls, has one row of cells; metres.
NARROWEST = 2 * CELL
# Largest area of all rooms, square metres; distances are kept for all pairs of cells.
LARGEST = 1000.0
# Least width and height of a window, metres; its frame takes 0.1 m of both.
SMALLEST_WINDOW = 0.2
_TOUCH = 1e-6

# Wall that two rooms share: the axis it is parallel to, its offset, start and end in metres, and
# the indices of the rooms.
SharedWall = tuple[str, float, float, float, int, int]


def room_label(plan: FloorPlan, index: int) -> str:
    """Return the name of a room in messages, such as `rooms[0] (kitchen)`."""
    return f"rooms[{index}] ({plan.rooms[index].kind})"


def room_faults(plan: FloorPlan) -> Iterator[str]:
    """Yield the faults of single rooms."""
    if not plan.rooms:
        yield "rooms is empty; give at least one room"
    for n, room in enumerate(plan.rooms):
        where = room_label(plan, n)
        if room.kind not in ROOM_KINDS:
            yield f"rooms[{n}]: room kind {room.kind!r} is none of {', '.join(ROOM_KINDS)}"
        for key in ("floor", "walls", "ceiling"):
            if (material := getattr(room, key)) not in MATERIALS:
                yield (
                    f"{where}: material {material!r} of '{key}' is not known; "
                    f"use one of {', '.join(MATERIALS)}"
                )
        for key in ("x0", "y0", "x1", "y1"):
            if (value := getattr(room, key)) % CELL:
                yield (
                    f"{where}: '{key}' is {value:g}; walls are on the {CELL} m lattice, "
                    f"give {round(value / CELL) * CELL:g}"
                )
        for low, high in (("x0", "x1"), ("y0", "y1")):
            side = getattr(room, high) - getattr(room, low)
            if side < NARROWEST:
                yield (
                    f"{where}: from {low} to {high} it is {side:g} m wide, too narrow for a cell; "
                    f"{high} must be at least {low} + {NARROWEST:g}"
                )
    area = sum((r.x1 - r.x0) * (r.y1 - r.y0) for r in plan.rooms)
    if area > LARGEST:
        yield f"the rooms cover {area:g} square metres; make them smaller, at most {LARGEST:g}"


def overlap_faults(plan: FloorPlan) -> Iterator[str]:
    """Yield the pairs of rooms that overlap."""
    for (i, a), (j, b) in combinations(enumerate(plan.rooms), 2):
        x0, x1, y0, y1 = max(a.x0, b.x0), min(a.x1, b.x1), max(a.y0, b.y0), min(a.y1, b.y1)
        if x0 < x1 and y0 < y1:
            yield (
                f"{room_label(plan, i)} and {room_label(plan, j)} overlap at x {x0:g} to {x1:g}, "
                f"y {y0:g} to {y1:g}; give them one common line as their wall"
            )


def gap_faults(plan: FloorPlan) -> Iterator[str]:
    """Yield the pairs of rooms that leave a gap where they were meant to share a wall."""
    spans = [(n, s) for n, room in enumerate(plan.rooms) for s in outer_spans(room, plan.rooms)]
    for (i, span), (j, other_span) in permutations(spans, 2):
        (along, line, low, high), (other_along, other, a, b) = span, other_span
        beside = min(high, b) > max(low, a)
        if along != other_along or not beside or not 0 < other - line < COURTYARD:
            continue
        across = "y" if along == "x" else "x"
        faces_up = line == getattr(plan.rooms[i], f"{across}1")
        if faces_up and other == getattr(plan.rooms[j], f"{across}0"):
            yield (
                f"{room_label(plan, i)} and {room_label(plan, j)} leave a gap at {across} {line:g} "
                f"to {other:g}; give them one common line as their wall, or keep them "
                f"{COURTYARD:g} m apart"
            )


def shared_walls(plan: FloorPlan) -> list[SharedWall]:
    """List the walls that two rooms share."""
    found: list[SharedWall] = []
    for (i, a), (j, b) in permutations(enumerate(plan.rooms), 2):
        first, second = min(i, j), max(i, j)
        low, high = max(a.y0, b.y0), min(a.y1, b.y1)
        if a.x1 == b.x0 and low < high:
            found.append(("y", a.x1, low, high, first, second))
        low, high = max(a.x0, b.x0), min(a.x1, b.x1)
        if a.y1 == b.y0 and low < high:
            found.append(("x", a.y1, low, high, first, second))
    return found


def _lines(opening: Doorway | Window) -> tuple[float, float]:
    """Return the offset of the wall that an opening is meant for, and the centre along it."""
    return (opening.y, opening.x) if opening.along == "x" else (opening.x, opening.y)


def _wall_at(
    opening: Doorway | Window, shared: list[SharedWall], along: str | None = None
) -> SharedWall | None:
    """Return the shared wall at the centre of an opening, or None."""
    along = along or opening.along
    line, centre = (opening.y, opening.x) if along == "x" else (opening.x, opening.y)
    return next((w for w in shared if w[:2] == (along, line) and w[2] < centre < w[3]), None)


def doorway_faults(plan: FloorPlan) -> Iterator[str]:
    """Yield the doorways that join no two rooms, and the rooms that no doorway leads to."""
    shared = shared_walls(plan)
    joined: list[tuple[int, int]] = []
    for n, door in enumerate(plan.doorways):
        where = f"doorways[{n}] at ({door.x:g}, {door.y:g})"
        if door.along not in ("x", "y"):
            yield f"{where}: 'along' is {door.along!r}, not 'x' or 'y'; give the axis of its wall"
        if door.x % CELL or door.y % CELL:
            yield f"{where}: is not centred on the {CELL} m lattice; move it"
        wall = _wall_at(door, shared)
        if wall is None:
            yield f"{where}: {_no_door(plan, door, shared)}"
        else:
            joined.append(wall[4:])
    for (m, a), (n, b) in combinations(enumerate(plan.doorways), 2):
        apart = abs(_lines(a)[1] - _lines(b)[1])
        if (a.along, _lines(a)[0]) == (b.along, _lines(b)[0]) and apart < DOOR_WIDTH:
            yield (
                f"doorways[{m}] and doorways[{n}] overlap at ({b.x:g}, {b.y:g}); delete one, or "
                f"place them at least {2 * CELL:g} m apart"
            )
    reached = {0}
    for _ in plan.rooms:
        reached |= {room for pair in joined if reached & set(pair) for room in pair}
    for n in range(len(plan.rooms)):
        if n not in reached:
            yield (
                f"{room_label(plan, n)} cannot be reached from {room_label(plan, 0)}; "
                "add a doorway to a room beside it"
            )


def _no_door(plan: FloorPlan, door: Doorway, shared: list[SharedWall]) -> str:
    other = "y" if door.along == "x" else "x"
    if _wall_at(door, shared, other) is not None:
        return f"the wall there is parallel to {other}; set 'along' to '{other}'"
    places = [
        f"from {low + CELL:g} to {high - CELL:g} on {'y' if along == 'x' else 'x'} = {line:g}"
        for along, line, low, high, *_ in shared
        if along == door.along and high - low >= 2 * CELL
    ]
    listed = f", {door.along} {' or '.join(places)}" if places else ""
    return f"lies on no wall shared by two rooms; move it onto one{listed}"


def window_faults(plan: FloorPlan) -> Iterator[str]:
    """Yield the windows that are not within an outer wall, or that overlap another."""
    for n, window in enumerate(plan.windows):
        where = f"windows[{n}] at ({window.x:g}, {window.y:g})"
        if window.along not in ("x", "y"):
            yield f"{where}: 'along' is {window.along!r}, not 'x' or 'y'; give the axis of its wall"
        for key in ("width", "height"):
            if (size := getattr(window, key)) < SMALLEST_WINDOW:
                yield f"{where}: '{key}' is {size:g}; give at least {SMALLEST_WINDOW:g} m"
        top = window.sill + window.height
        if window.sill < 0 or top > CEILING + _TOUCH:
            yield (
                f"{where}: reaches from {window.sill:g} to {top:g} m; sill and sill + height must "
                f"be within 0 and {CEILING:g} m, the height of the ceiling"
            )
        if (fault := _outside_of_walls(plan, window)) is not None:
            yield f"{where}: {fault}"
    for (m, a), (n, b) in combinations(enumerate(plan.windows), 2):
        beside = abs(_lines(a)[1] - _lines(b)[1]) < (a.width + b.width) / 2 - _TOUCH
        above = a.sill < b.sill + b.height - _TOUCH and b.sill < a.sill + a.height - _TOUCH
        if (a.along, _lines(a)[0]) == (b.along, _lines(b)[0]) and beside and above:
            yield f"windows[{m}] and windows[{n}] overlap at ({b.x:g}, {b.y:g}); move one"


def _outside_of_walls(plan: FloorPlan, window: Window) -> str | None:
    line, centre = _lines(window)
    low, high = centre - window.width / 2, centre + window.width / 2
    spans = [
        (n, start + WALL_THICKNESS / 2, end - WALL_THICKNESS / 2)
        for n, room in enumerate(plan.rooms)
        for along, offset, start, end in outer_spans(room, plan.rooms)
        if along == window.along and abs(offset - line) < _TOUCH
    ]
    if any(a - _TOUCH <= low and high <= b + _TOUCH for _, a, b in spans):
        return None
    if (wall := _wall_at(window, shared_walls(plan))) is not None:
        return (
            f"lies in the wall between {room_label(plan, wall[4])} and "
            f"{room_label(plan, wall[5])}; move it to an outer wall"
        )
    for n, a, b in spans:
        if a < centre < b:
            return (
                f"spans {window.along} {low:g} to {high:g}, more than the outer wall of "
                f"{room_label(plan, n)} from {a:g} to {b:g}; move it or make it narrower"
            )
    return (
        f"lies on no outer wall that is parallel to {window.along}; put its centre on the centre "
        "line of one"
    )
