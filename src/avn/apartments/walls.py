"""Solid parts of a floor plan: walls without their doorways, and obstacles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import DOOR_WIDTH, WALL_THICKNESS, Doorway, FloorPlan, Piece

Interval = tuple[float, float]
# Furniture with its underside at or above this height is no obstacle; metres.
HEADROOM = 1.7


def _union(intervals: list[Interval]) -> list[Interval]:
    merged: list[Interval] = []
    for low, high in sorted(intervals):
        if merged and low <= merged[-1][1] + 1e-9:
            merged[-1] = (merged[-1][0], max(high, merged[-1][1]))
        else:
            merged.append((low, high))
    return merged


def _cut(intervals: list[Interval], gap: Interval) -> list[Interval]:
    rest: list[Interval] = []
    for low, high in intervals:
        pieces = [(low, min(high, gap[0])), (max(low, gap[1]), high)]
        rest += [(a, b) for a, b in pieces if b - a > 1e-9]
    return rest


def walls(plan: FloorPlan) -> NDArray[np.float64]:
    """Compute the wall blocks of a plan, 0.1 m thick, with the doorways left out.

    Parameters
    ----------
    plan : FloorPlan
        The apartment.

    Returns
    -------
    (W, 4) float64
        Rectangles x0, y0, x1, y1 in metres. They extend 0.05 m beyond the corners, so that walls
        that meet leave no gap; at a doorway they end at its jamb.
    """
    lines: dict[tuple[str, float], list[Interval]] = {}
    for room in plan.rooms:
        for y in (room.y0, room.y1):
            lines.setdefault(("x", round(y, 6)), []).append((room.x0, room.x1))
        for x in (room.x0, room.x1):
            lines.setdefault(("y", round(x, 6)), []).append((room.y0, room.y1))
    half = WALL_THICKNESS / 2
    blocks: list[tuple[float, float, float, float]] = []
    for (along, line), spans in sorted(lines.items()):
        rest = [(low - half, high + half) for low, high in _union(spans)]
        for gap in (g for d in plan.doorways if (g := _gap(d, along, line)) is not None):
            rest = _cut(rest, gap)
        for low, high in rest:
            block = (low, line - half, high, line + half)
            blocks.append(block if along == "x" else (block[1], block[0], block[3], block[2]))
    return np.array(blocks, dtype=np.float64).reshape(-1, 4)


def _gap(doorway: Doorway, along: str, line: float) -> Interval | None:
    across, centre = (doorway.y, doorway.x) if doorway.along == "x" else (doorway.x, doorway.y)
    if doorway.along != along or abs(across - line) > 1e-6:
        return None
    return centre - DOOR_WIDTH / 2, centre + DOOR_WIDTH / 2


def is_obstacle(piece: Piece) -> bool:
    """Return True if a piece blocks an agent: its underside is below 1.7 m."""
    return piece.z < HEADROOM


def obstacles(plan: FloorPlan) -> NDArray[np.float64]:
    """Return walls and furniture that block an agent, (B, 4) x0, y0, x1, y1 in metres."""
    boxes = [piece.bounds for piece in plan.furniture if is_obstacle(piece)]
    return np.concatenate([walls(plan), np.array(boxes, dtype=np.float64).reshape(-1, 4)])
