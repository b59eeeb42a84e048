"""Spheres that listen, and which of them a ray passes: compiled."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Listeners(NamedTuple):
    """L spheres sorted into square columns over x and y.

    `box` (2, 3) bounds them all, `cell` is the width of a column, `shape` (2,) their number along
    x and y; `members[starts[c] : starts[c + 1]]` are the spheres that reach into column c;
    `centres` (L, 3) and `radius` are their own.
    """

    box: NDArray[np.float64]
    cell: float
    shape: NDArray[np.int64]
    starts: NDArray[np.int64]
    members: NDArray[np.int64]
    centres: NDArray[np.float64]
    radius: float


class Met(NamedTuple):
    """Room for the answers of `passed_listeners`, (L,) each."""

    seen: NDArray[np.int64]
    found: NDArray[np.int64]
    chords: NDArray[np.float64]
    middles: NDArray[np.float64]


def sort_listeners(centres: NDArray[np.float64], radius: float) -> Listeners:
    """Sort spheres with the given centres (L, 3) into columns as wide as a sphere."""
    cell = 2 * radius
    low, high = centres.min(axis=0) - radius, centres.max(axis=0) + radius
    shape = np.maximum(np.ceil((high[:2] - low[:2]) / cell - 1e-6), 1).astype(np.int64)
    # Spheres on a lattice of one diameter touch their neighbours' columns without entering them.
    first = np.floor((centres[:, :2] - radius - low[:2]) / cell + 1e-6).astype(np.int64)
    last = np.floor((centres[:, :2] + radius - low[:2]) / cell - 1e-6).astype(np.int64)
    first, last = np.clip(first, 0, shape - 1), np.clip(last, 0, shape - 1)
    columns, owners = [], []
    for dx in range(2):
        for dy in range(2):
            place = first + np.array([dx, dy])
            inside = (place <= last).all(axis=1)
            columns.append(place[inside, 0] * shape[1] + place[inside, 1])
            owners.append(np.flatnonzero(inside))
    column, member = np.concatenate(columns), np.concatenate(owners)
    order = np.lexsort((member, column))
    counts = np.bincount(column, minlength=int(shape.prod()))
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    members = member[order].astype(np.int64)
    return Listeners(np.stack([low, high]), cell, shape, starts, members, centres, radius)


@njit(cache=True)
def _clip(low: float, high: float, here: float, slope: float, near: float, far: float):  # type: ignore[no-untyped-def]
    """The part of [near, far] of a ray where one coordinate lies within [low, high]."""
    if abs(slope) < 1e-12:
        return (near, far) if low <= here <= high else (1.0, 0.0)
    a, b = (low - here) / slope, (high - here) / slope
    if a > b:
        a, b = b, a
    return max(near, a), min(far, b)


@njit(cache=True)
def passed_listeners(  # type: ignore[no-untyped-def]
    position, direction, length, listeners: Listeners, met: Met, stamp: int
) -> int:
    """Listeners whose sphere a stretch of a ray crosses.

    The columns are walked one after the other. `met.seen` marks with `stamp` who has been
    looked at, since a sphere may lie in several columns. Writes index, chord length and distance
    of the chord's middle into `met` and returns the count.
    """
    box, cell, shape = listeners.box, listeners.cell, listeners.shape
    centres, radius = listeners.centres, listeners.radius
    near, far = 0.0, length
    for axis in range(3):
        near, far = _clip(box[0, axis], box[1, axis], position[axis], direction[axis], near, far)
    count = 0
    if near >= far:
        return count
    # Where the walk starts, and where along the ray it crosses the next line of the grid.
    ix = min(max(int((position[0] + near * direction[0] - box[0, 0]) / cell), 0), shape[0] - 1)
    iy = min(max(int((position[1] + near * direction[1] - box[0, 1]) / cell), 0), shape[1] - 1)
    sx = 1 if direction[0] > 0 else -1
    sy = 1 if direction[1] > 0 else -1
    next_x = next_y = math.inf
    step_x = step_y = math.inf
    if abs(direction[0]) > 1e-12:
        step_x = cell / abs(direction[0])
        next_x = (box[0, 0] + (ix + (sx > 0)) * cell - position[0]) / direction[0]
    if abs(direction[1]) > 1e-12:
        step_y = cell / abs(direction[1])
        next_y = (box[0, 1] + (iy + (sy > 0)) * cell - position[1]) / direction[1]
    while True:
        where = ix * shape[1] + iy
        for entry in range(listeners.starts[where], listeners.starts[where + 1]):
            who = listeners.members[entry]
            if met.seen[who] == stamp:
                continue
            met.seen[who] = stamp
            dx = centres[who, 0] - position[0]
            dy = centres[who, 1] - position[1]
            dz = centres[who, 2] - position[2]
            along = dx * direction[0] + dy * direction[1] + dz * direction[2]
            half = radius * radius - (dx * dx + dy * dy + dz * dz - along * along)
            if half <= 0.0:
                continue
            half = math.sqrt(half)
            enter, leave = max(along - half, 0.0), min(along + half, length)
            if leave > enter:
                met.found[count] = who
                met.chords[count] = leave - enter
                met.middles[count] = 0.5 * (enter + leave)
                count += 1
        if next_x < next_y:
            if next_x > far:
                break
            ix += sx
            next_x += step_x
        else:
            if next_y > far:
                break
            iy += sy
            next_y += step_y
        if ix < 0 or iy < 0 or ix >= shape[0] or iy >= shape[1]:
            break
    return count
