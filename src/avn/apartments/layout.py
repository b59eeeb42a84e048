"""Random layouts of apartments: rooms, doorways and windows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np

from avn.apartments.floor_plan import CELL, Doorway, FloorPlan, Room, Window
from avn.core.random import Rng

Rect = tuple[int, int, int, int]
Edge = tuple[int, int]
# Materials of the floors and of the walls of each kind of room; one of each is drawn.
Finish = Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]]


@dataclass(frozen=True)
class Measure:
    """Size limits of a kind of room: sides in half metres between wall lines, and grid squares."""

    short: tuple[int, int]
    long: tuple[int, int]
    squares: tuple[int, int]

    def fits(self, rect: Rect) -> bool:
        """Return True if a room of this kind may have this shape."""
        short, long = sorted((rect[2] - rect[0], rect[3] - rect[1]))
        return (
            self.short[0] <= short <= self.short[1]
            and self.long[0] <= long <= self.long[1]
            and self.squares[0] <= (short - 1) * (long - 1) <= self.squares[1]
        )


MEASURES = {
    "bathroom": Measure((4, 5), (5, 7), (12, 20)),
    "kitchen": Measure((5, 8), (6, 10), (20, 49)),
    "bedroom": Measure((6, 8), (6, 10), (25, 56)),
    "living_room": Measure((7, 9), (8, 13), (42, 88)),
}
KINDS = {
    3: ("kitchen", "bedroom", "bathroom"),
    4: ("living_room", "kitchen", "bedroom", "bathroom"),
    5: ("living_room", "kitchen", "bedroom", "bedroom", "bathroom"),
}
FINISH: Finish = {
    "bathroom": (("floor_tiles",), ("wall_tiles",)),
    "kitchen": (("floor_tiles", "parquet"), ("plaster", "plaster", "painted_brick")),
    "bedroom": (("parquet", "carpet"), ("plaster",)),
    "living_room": (("parquet", "parquet", "carpet"), ("plaster", "plaster", "painted_brick")),
}
# Homes with soft furnishing: most bedrooms and living rooms have a carpet.
SOFT_FINISH: Finish = {
    **FINISH,
    "bedroom": (("parquet", *("carpet",) * 7), ("plaster",)),
    "living_room": (("parquet", *("carpet",) * 4), ("plaster", "plaster", "painted_brick")),
}
# Cost of a door between two kinds of room; other pairs never have one.
DOOR_COST = {
    ("kitchen", "living_room"): 0.0,
    ("bedroom", "living_room"): 0.0,
    ("bathroom", "living_room"): 1.0,
    ("bedroom", "kitchen"): 1.0,
    ("bathroom", "kitchen"): 1.5,
    ("bathroom", "bedroom"): 1.5,
}
# Width, sill and height of windows, metres.
WINDOWS = {
    "bathroom": (0.6, 1.5, 0.6),
    "kitchen": (1.2, 1.1, 1.0),
    "bedroom": (1.4, 0.9, 1.3),
    "living_room": (1.8, 0.9, 1.4),
}


def _split(rects: list[Rect], leaves: int, rng: Rng) -> list[Rect] | None:
    """Split a rectangle at random into `leaves` rectangles with sides of at least 2 m."""
    while len(rects) < leaves:
        weights = [((r[2] - r[0]) * (r[3] - r[1])) ** 2 for r in rects]
        index, drawn = 0, rng.random() * sum(weights)
        while drawn > weights[index]:
            drawn -= weights[index]
            index += 1
        x0, y0, x1, y1 = rects.pop(index)
        wide = x1 - x0 > y1 - y0 if rng.random() < 0.8 else x1 - x0 <= y1 - y0
        low, high = (x0 + 4, x1 - 4) if wide else (y0 + 4, y1 - 4)
        if low > high:
            return None
        cut = int(rng.integers(low, high + 1))
        rects += [(x0, y0, cut, y1), (cut, y0, x1, y1)] if wide else []
        rects += [] if wide else [(x0, y0, x1, cut), (x0, cut, x1, y1)]
    return rects


def _corner(rect: Rect, width: int, height: int) -> bool:
    return (rect[0] == 0 or rect[2] == width) and (rect[1] == 0 or rect[3] == height)


def _shapes(count: int, squares: tuple[int, int], rng: Rng) -> list[Rect] | None:
    """Draw rectangles that tile a rectangle or an L; return None if the draw does not fit."""
    l_shaped = bool(rng.random() < 0.5)
    # Walls take about a quarter of all squares, and the corner left out of an L some more.
    area = rng.integers(squares[0], squares[1] + 1) * (1.5 if l_shaped else 1.3)
    width = int(np.rint(np.sqrt(area * rng.uniform(1.0, 1.8))))
    height = int(np.rint(area / width))
    rects = _split([(0, 0, width, height)], count + l_shaped, rng)
    if rects is None:
        return None
    if l_shaped:
        corners = [r for r in rects if _corner(r, width, height)]
        left_out = corners[int(rng.integers(len(corners)))]
        # The corner that is left out must not span a whole side, else the rest is no L.
        if left_out[2] - left_out[0] == width or left_out[3] - left_out[1] == height:
            return None
        rects = [r for r in rects if r != left_out]
    total = sum((r[2] - r[0] - 1) * (r[3] - r[1] - 1) for r in rects) + count - 1
    return rects if squares[0] <= total <= squares[1] else None


def _kinds(rects: list[Rect], rng: Rng) -> list[str] | None:
    fitting = sorted(
        {
            order
            for order in permutations(KINDS[len(rects)])
            if all(MEASURES[kind].fits(rect) for kind, rect in zip(order, rects, strict=True))
        }
    )
    if not fitting:
        return None
    # The living room must be the largest room.
    sizes = [(r[2] - r[0] - 1) * (r[3] - r[1] - 1) for r in rects]
    best = [
        o for o in fitting if "living_room" not in o or sizes[o.index("living_room")] == max(sizes)
    ]
    return list(best[int(rng.integers(len(best)))]) if best else None


def _shared(a: Rect, b: Rect) -> tuple[str, int, int, int] | None:
    """Return the wall that two rooms share: axis parallel to it, offset, and span; else None."""
    for along, p, q in (("y", 0, 1), ("x", 1, 0)):
        for line in {a[p], a[p + 2]} & {b[p], b[p + 2]}:
            low, high = max(a[q], b[q]), min(a[q + 2], b[q + 2])
            if high - low >= 2 and (a[p] == line) != (b[p] == line):
                return along, line, low, high
    return None


def _trees(count: int, edges: list[Edge]) -> list[tuple[Edge, ...]]:
    """List all spanning trees of the rooms."""
    trees = []
    for tree in combinations(edges, count - 1):
        group = list(range(count))
        for a, b in tree:
            group = [group[a] if g == group[b] else g for g in group]
        if len(set(group)) == 1:
            trees.append(tree)
    return trees


def _layout_cost(tree: tuple[Edge, ...], kinds: list[str]) -> float:
    """Sum the cost of a tree of doors; inf for one that is not plausible."""
    degree = np.bincount(np.array(tree).ravel(), minlength=len(kinds))
    cost = 0.0
    for a, b in tree:
        pair = (min(kinds[a], kinds[b]), max(kinds[a], kinds[b]))
        if pair not in DOOR_COST or (
            pair == ("bathroom", "bedroom") and kinds.count("bedroom") > 1
        ):
            return np.inf
        cost += DOOR_COST[pair]
    for room, kind in enumerate(kinds):
        if kind == "bathroom" and degree[room] > 1:
            return np.inf
        # A bedroom is no passage, except to a bathroom of its own.
        beyond = [kinds[b if a == room else a] for a, b in tree if room in (a, b)]
        if kind == "bedroom" and sum(other != "bathroom" for other in beyond) > 1:
            return np.inf
    return cost if cost <= 3.5 else np.inf


def _doorways(rects: list[Rect], kinds: list[str], rng: Rng) -> list[Doorway] | None:
    shared = {
        (a, b): wall
        for a, b in combinations(range(len(rects)), 2)
        if (wall := _shared(rects[a], rects[b])) is not None
    }
    ranked = [
        (_layout_cost(t, kinds) + rng.random(), t) for t in _trees(len(rects), sorted(shared))
    ]
    ranked = [(cost, tree) for cost, tree in ranked if np.isfinite(cost)]
    if not ranked:
        return None
    doors = []
    for edge in min(ranked)[1]:
        along, line, low, high = shared[edge]
        # Doors are near a corner, so that the rest of the wall is left for furniture.
        spots = [s for s in {low + 1, low + 2, high - 2, high - 1} if low < s < high]
        spot = sorted(spots)[int(rng.integers(len(spots)))]
        x, y = (spot, line) if along == "x" else (line, spot)
        doors.append(Doorway(x * CELL, y * CELL, along))
    return doors


def outer_spans(room: Room, rooms: tuple[Room, ...]) -> list[tuple[str, float, float, float]]:
    """Find the parts of a room's walls that face outside: axis, offset, start, end; metres.

    Rooms tile the apartment without overlap, so a part is outer if no other room has that wall.
    """
    spans = []
    sides = (
        ("x", room.y0, room.x0, room.x1),
        ("x", room.y1, room.x0, room.x1),
        ("y", room.x0, room.y0, room.y1),
        ("y", room.x1, room.y0, room.y1),
    )
    for along, line, low, high in sides:
        taken = []
        for other in rooms:
            lines = (other.y0, other.y1) if along == "x" else (other.x0, other.x1)
            if other is not room and line in lines:
                taken.append((other.x0, other.x1) if along == "x" else (other.y0, other.y1))
        start = low
        for a, b in sorted(taken):
            if min(a, high) > start:
                spans.append((along, line, start, min(a, high)))
            start = max(start, min(b, high))
        if high > start:
            spans.append((along, line, start, high))
    return spans


def _windows(rooms: tuple[Room, ...], rng: Rng) -> list[Window] | None:
    windows = []
    for room in rooms:
        width, sill, height = WINDOWS[room.kind]
        spans = [s for s in outer_spans(room, rooms) if s[3] - s[2] >= width + 0.6]
        if not spans and room.kind != "bathroom":
            return None
        rng.shuffle(spans)
        for along, line, low, high in spans[: 2 if room.kind == "living_room" else 1]:
            middle = (low + high) / 2
            x, y = (middle, line) if along == "x" else (line, middle)
            windows.append(Window(x, y, along, width, sill, height))
    return windows


def draw_layout(
    name: str, count: int, squares: tuple[int, int], rng: Rng, finish: Finish = FINISH
) -> FloorPlan | None:
    """Draw rooms, doorways and windows.

    Parameters
    ----------
    name : str
        Name of the apartment.
    count : int
        Number of rooms, 3 to 5.
    squares : (int, int)
        Fewest and most grid squares of the whole apartment.
    rng : Generator or Draws
        Random numbers.
    finish : mapping
        Materials to draw, by kind of room: floors, walls.

    Returns
    -------
    FloorPlan or None
        Without furniture, lamps and sources; None if the draw is not valid.
    """
    rects = _shapes(count, squares, rng)
    kinds = _kinds(rects, rng) if rects is not None else None
    if rects is None or kinds is None:
        return None
    doors = _doorways(rects, kinds, rng)
    if doors is None:
        return None
    rooms = []
    for kind, rect in zip(kinds, rects, strict=True):
        floors, walls = finish[kind]
        x0, y0, x1, y1 = (v * CELL for v in rect)
        floor, wall = str(rng.choice(floors)), str(rng.choice(walls))
        rooms.append(Room(kind, x0, y0, x1, y1, floor, wall, "ceiling_plaster"))
    windows = _windows(tuple(rooms), rng)
    if windows is None:
        return None
    return replace(FloorPlan(name, tuple(rooms), tuple(doors)), windows=tuple(windows))
