"""Placement of groups of furniture in a room, with all free floor connected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from avn.apartments.floor_plan import CELL, DOOR_WIDTH, WALL_THICKNESS, FloorPlan, Piece, Room
from avn.apartments.furniture import Group, Part, Rect
from avn.apartments.grid import free_squares
from avn.core.random import Rng

# Depth of the free floor on either side of a doorway, for the leaf of the door; metres.
DOOR_CLEARANCE = 0.9
# Depth of the floor before a window that high furniture must not stand on; metres.
PANE_CLEARANCE = 0.35
# Unit vectors of the headings north, east, south, west.
FORWARD = ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0))
_TOUCH = 1e-6
# Positions of a group that are tried for connected free floor.
_TRIES = 12


@dataclass(frozen=True)
class Spot:
    """Candidate pose of a group: world point of (u, v) = (0, 0) in metres, heading and score."""

    x: float
    y: float
    heading: int
    score: float

    def place(self, rect: Rect) -> Rect:
        """Transform a rectangle from the group's frame to the world's."""
        right, front = FORWARD[(self.heading + 1) % 4], FORWARD[self.heading]
        xs = [self.x + u * right[0] + v * front[0] for u, v in (rect[:2], rect[2:])]
        ys = [self.y + u * right[1] + v * front[1] for u, v in (rect[:2], rect[2:])]
        return min(xs), min(ys), max(xs), max(ys)

    def piece(self, part: Part) -> Piece:
        """Convert a part of the group to a piece of the floor plan, rounded to 0.1 mm."""
        x0, y0, x1, y1 = self.place(part.rect)
        model = part.model
        return Piece(
            kind=model.kind,
            x=round((x0 + x1) / 2, 4),
            y=round((y0 + y1) / 2, 4),
            width=model.width,
            depth=model.depth,
            height=model.height,
            heading=(self.heading + part.turn) % 4,
            material=model.material,
            z=model.z,
        )


def overlap(a: Rect, b: Rect) -> bool:
    """Return True if two rectangles share more than an edge."""
    low_x, low_y = max(a[0], b[0]), max(a[1], b[1])
    high_x, high_y = min(a[2], b[2]), min(a[3], b[3])
    return high_x - low_x > _TOUCH and high_y - low_y > _TOUCH


def inside(a: Rect, b: Rect) -> bool:
    """Return True if rectangle `a` is within `b`."""
    return (
        a[0] > b[0] - _TOUCH
        and a[1] > b[1] - _TOUCH
        and a[2] < b[2] + _TOUCH
        and a[3] < b[3] + _TOUCH
    )


class Furnisher:
    """A room that is being furnished: its pieces, and the zones that must stay free.

    Parameters
    ----------
    plan : FloorPlan
        Doorways and windows keep floor free; furniture of the plan is ignored.
    room : Room
        Room of the plan.
    rng : Generator or Draws
        Random numbers.
    """

    def __init__(self, plan: FloorPlan, room: Room, rng: Rng) -> None:
        half = WALL_THICKNESS / 2
        self.rng = rng
        self.floor: Rect = (room.x0 + half, room.y0 + half, room.x1 - half, room.y1 - half)
        self.pieces: list[Piece] = []
        self.zones: list[Rect] = []
        self._walls_with_windows = self._panes(plan)
        self._squares = self._room_squares(plan, room)

    def _panes(self, plan: FloorPlan) -> list[tuple[Rect, float]]:
        """Return the floor before each window of the room, 0.35 m deep, and its sill's height."""
        panes = []
        for window in plan.windows:
            a, b = window.width / 2, WALL_THICKNESS / 2 + PANE_CLEARANCE
            if window.along == "y":
                a, b = b, a
            rect = (window.x - a, window.y - b, window.x + a, window.y + b)
            if overlap(rect, self.floor):
                panes.append((rect, window.sill))
        return panes

    def _room_squares(self, plan: FloorPlan, room: Room) -> NDArray[np.int32]:
        bounds = np.rint(np.array([room.x0, room.y0, room.x1, room.y1]) / CELL).astype(int)
        xs, ys = np.arange(bounds[0] + 1, bounds[2]), np.arange(bounds[1] + 1, bounds[3])
        squares = [np.stack(np.meshgrid(xs, ys), -1).reshape(-1, 2)]
        for door in plan.doorways:
            at = np.rint(np.array([door.x, door.y]) / CELL).astype(int)
            if (at >= bounds[:2]).all() and (at <= bounds[2:]).all():
                squares.append(at[None])
                reach = DOOR_CLEARANCE + WALL_THICKNESS / 2
                a, b = (DOOR_WIDTH / 2, reach) if door.along == "x" else (reach, DOOR_WIDTH / 2)
                self.zones.append((door.x - a, door.y - b, door.x + a, door.y + b))
        return np.concatenate(squares).astype(np.int32)

    def _wall(self, heading: int) -> tuple[float, float, float]:
        """Return the left end (x, y) and length of the wall behind a group that faces `heading`."""
        x0, y0, x1, y1 = self.floor
        corner = ((x0, y0), (x0, y1), (x1, y1), (x1, y0))[heading]
        return *corner, (y1 - y0) if heading % 2 else (x1 - x0)

    def across(self, heading: int) -> float:
        """Return the depth of the room in the direction `heading`, metres."""
        x0, y0, x1, y1 = self.floor
        return x1 - x0 if heading % 2 else y1 - y0

    def is_before_window(self, rect: Rect) -> bool:
        """Return True if a rectangle is before a window of the room."""
        return any(overlap(rect, pane) for pane, _ in self._walls_with_windows)

    def _spots_at_walls(self, group: Group) -> list[Spot]:
        spots = []
        width, centre = group.extent[2] - group.extent[0], group.extent[0]
        for heading in range(4):
            if group.across and abs(group.across - self.across(heading)) > _TOUCH:
                continue
            x, y, length = self._wall(heading)
            right = FORWARD[(heading + 1) % 4]
            room = length - width
            if room < -_TOUCH:
                continue
            edges = [0.0, room]
            if not group.corner_only:
                edges += [room / 2, *np.arange(0.25, room, 0.25)]
            for at in sorted({round(max(edge, 0.0), 4) for edge in edges}):
                shift = at - centre
                score = self._wall_score(group, at, room) + self.rng.random()
                spots.append(Spot(x + shift * right[0], y + shift * right[1], heading, score))
        return spots

    def _wall_score(self, group: Group, at: float, room: float) -> float:
        """Score a position along a wall: bonuses of the group, minus gaps of less than 0.45 m."""
        gaps = (at, room - at)
        score = group.corner * (min(gaps) < _TOUCH)
        score -= 1.5 * sum(_TOUCH < gap < 0.45 for gap in gaps)
        if room > _TOUCH:
            score += group.centre * (1 - abs(2 * at / room - 1))
        return float(score)

    def _spots_in_the_room(self, group: Group) -> list[Spot]:
        x0, y0, x1, y1 = self.floor
        middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
        spots = []
        for x in np.arange(np.ceil(x0 * 4) / 4, x1, 0.25):
            for y in np.arange(np.ceil(y0 * 4) / 4, y1, 0.25):
                off = float(np.abs(np.array([x, y]) - middle).max())
                for heading in (0, 1):
                    spots.append(Spot(float(x), float(y), heading, self.rng.random() - 0.5 * off))
        return spots

    def _fits(self, group: Group, spot: Spot) -> list[Piece] | None:
        """Return the group's pieces at a spot, or None if they collide with anything."""
        pieces = [spot.piece(part) for part in group.parts]
        zones = [spot.place(zone) for zone in group.zones]
        standing = [piece.bounds for piece in self.pieces]
        for piece in pieces:
            rect = piece.bounds
            if not inside(rect, self.floor) or any(overlap(rect, s) for s in standing + self.zones):
                return None
            top = piece.z + piece.height
            if any(top > sill and overlap(rect, pane) for pane, sill in self._walls_with_windows):
                return None
        for zone in zones:
            if not inside(zone, self.floor) or any(overlap(zone, s) for s in standing):
                return None
        return pieces

    def _walkable(self, pieces: Sequence[Piece], zones: Sequence[Rect]) -> bool:
        """Return True if all free squares are connected, with one at every zone and chair."""
        boxes = np.array([piece.bounds for piece in pieces], dtype=np.float64).reshape(-1, 4)
        free, neighbours = free_squares(self._squares, boxes)
        start, heading = np.nonzero(neighbours >= 0)
        graph = csr_matrix(
            (np.ones(len(start)), (start, neighbours[start, heading])), shape=(len(neighbours),) * 2
        )
        if connected_components(graph, directed=False)[0] != 1:
            return False
        centres = self._squares[free] * CELL
        for x0, y0, x1, y1 in zones:
            reach = (centres > (x0 - 0.25, y0 - 0.25)) & (centres < (x1 + 0.25, y1 + 0.25))
            if not reach.all(axis=1).any():
                return False
        for box in boxes[[piece.kind == "chair" for piece in pieces]]:
            off = np.maximum(np.maximum(box[:2] - centres, centres - box[2:]), 0.0)
            if np.hypot(*off.T).min() > CELL:
                return False
        return True

    def add(self, group: Group) -> bool:
        """Place a group at the valid spot of the highest score; return False if there is none."""
        spots = (
            self._spots_at_walls(group) if group.against_wall else self._spots_in_the_room(group)
        )
        tried = 0
        for spot in sorted(spots, key=lambda spot: -spot.score):
            pieces = self._fits(group, spot)
            if pieces is None:
                continue
            zones = self.zones + [spot.place(zone) for zone in group.zones]
            if self._walkable(self.pieces + pieces, zones):
                self.pieces += pieces
                self.zones = zones
                return True
            tried += 1
            if tried == _TRIES:
                break
        return False
