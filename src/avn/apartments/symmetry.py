"""Comparison of layouts up to rotation, mirroring and translation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CELL, ROOM_KINDS, FloorPlan
from avn.apartments.grid import squares_of

Key = tuple[tuple[str, int, int, int, int], ...]


def layout_key(plan: FloorPlan) -> Key:
    """Compute a key that is equal for two plans if and only if their layouts are congruent.

    The key is the smallest of the eight rotated and mirrored forms of the rooms (kind and bounds,
    in centimetres) and doorways, with the south-west corner at the origin. Furniture does not
    count.
    """
    shapes = [(room.kind, room.x0, room.y0, room.x1, room.y1) for room in plan.rooms]
    shapes += [("doorway", door.x, door.y, door.x, door.y) for door in plan.doorways]
    return min(_form(shapes, turn) for turn in range(8))


def _form(shapes: list[tuple[str, float, float, float, float]], turn: int) -> Key:
    forms = []
    for kind, *bounds in shapes:
        x0, y0, x1, y1 = (round(100 * value) for value in bounds)
        if turn & 1:
            x0, x1 = -x1, -x0
        if turn & 2:
            y0, y1 = -y1, -y0
        if turn & 4:
            x0, y0, x1, y1 = y0, x0, y1, x1
        forms.append((kind, x0, y0, x1, y1))
    left, low = min(form[1] for form in forms), min(form[2] for form in forms)
    return tuple(sorted((k, a - left, b - low, c - left, d - low) for k, a, b, c, d in forms))


def layout_similarity(a: FloorPlan, b: FloorPlan) -> float:
    """Compute the similarity of two layouts, from 0 to 1.

    The intersection over union of the grid squares, where squares match if their rooms are of
    the same kind (doorways are a kind), maximised over the eight rotated and mirrored forms of one
    layout and over shifts of up to 1 m from the centre. Congruent layouts give 1.
    """
    first = _raster(a)
    best = 0.0
    for turn in range(8):
        second = _raster(b)
        second = second[::-1] if turn & 1 else second
        second = second[:, ::-1] if turn & 2 else second
        second = second.T if turn & 4 else second
        size = [max(n, m) + 4 for n, m in zip(first.shape, second.shape, strict=True)]
        base = np.zeros(size, dtype=np.int8)
        ox, oy = ((size[k] - first.shape[k]) // 2 for k in (0, 1))
        base[ox : ox + first.shape[0], oy : oy + first.shape[1]] = first
        spare = [size[k] - second.shape[k] for k in (0, 1)]
        for dx in range(max(0, spare[0] // 2 - 2), min(spare[0], spare[0] // 2 + 2) + 1):
            for dy in range(max(0, spare[1] // 2 - 2), min(spare[1], spare[1] // 2 + 2) + 1):
                other = np.zeros(size, dtype=np.int8)
                other[dx : dx + second.shape[0], dy : dy + second.shape[1]] = second
                same = ((base == other) & (base != 0)).sum()
                best = max(best, float(same / ((base != 0) | (other != 0)).sum()))
    return best


def _raster(plan: FloorPlan) -> NDArray[np.int8]:
    """Rasterise a plan: 1 + the kind of room of every square, -1 in doorways, 0 elsewhere."""
    lattice, rooms = squares_of(plan)
    corner = lattice.min(axis=0)
    lattice = lattice - corner
    kinds = np.array([1 + ROOM_KINDS.index(room.kind) for room in plan.rooms], dtype=np.int8)
    raster = np.zeros(lattice.max(axis=0) + 1, dtype=np.int8)
    raster[tuple(lattice.T)] = kinds[rooms]
    doors = np.rint(np.array([(door.x, door.y) for door in plan.doorways]) / CELL).astype(int)
    raster[tuple((doors.reshape(-1, 2) - corner).T)] = -1
    return raster
