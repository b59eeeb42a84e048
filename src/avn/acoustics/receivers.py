"""Receiver spheres in a uniform grid, and their intersection with rays, compiled by Numba."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Receivers(NamedTuple):
    """Receiver spheres, L in all, sorted into square columns over x and y.

    Attributes
    ----------
    box : (2, 3) float64
        Bounds of all spheres, metres.
    cell : float
        Width of a column, metres.
    shape : (2,) int64
        Number of columns along x and y.
    starts, members : int64
        `members[starts[c] : starts[c + 1]]` are the spheres that reach into column c.
    centres : (L, 3) float64
        Metres.
    radius : float
        Metres.
    """

    box: NDArray[np.float64]
    cell: float
    shape: NDArray[np.int64]
    starts: NDArray[np.int64]
    members: NDArray[np.int64]
    centres: NDArray[np.float64]
    radius: float


class Hits(NamedTuple):
    """Buffers for the result of `intersected_receivers`, (L,) each.

    Attributes
    ----------
    last_stamp : int64
        Stamp of the ray segment that last tested a receiver.
    receivers : int64
        Indices of the receivers that are hit.
    chords, midpoints : float64
        Length of each chord and distance to its middle along the ray, metres.
    """

    last_stamp: NDArray[np.int64]
    receivers: NDArray[np.int64]
    chords: NDArray[np.float64]
    midpoints: NDArray[np.float64]


def sort_receivers(centres: NDArray[np.float64], radius: float) -> Receivers:
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
            square = first + np.array([dx, dy])
            inside = (square <= last).all(axis=1)
            columns.append(square[inside, 0] * shape[1] + square[inside, 1])
            owners.append(np.flatnonzero(inside))
    column, member = np.concatenate(columns), np.concatenate(owners)
    order = np.lexsort((member, column))
    counts = np.bincount(column, minlength=int(shape.prod()))
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    members = member[order].astype(np.int64)
    return Receivers(np.stack([low, high]), cell, shape, starts, members, centres, radius)


@njit(cache=True)
def _clip(low: float, high: float, here: float, slope: float, near: float, far: float):  # type: ignore[no-untyped-def]
    """Clip the interval [near, far] of a ray to where one coordinate is within [low, high]."""
    if abs(slope) < 1e-12:
        return (near, far) if low <= here <= high else (1.0, 0.0)
    a, b = (low - here) / slope, (high - here) / slope
    if a > b:
        a, b = b, a
    return max(near, a), min(far, b)


@njit(cache=True)
def intersected_receivers(  # type: ignore[no-untyped-def]
    position, direction, length, receivers: Receivers, hits: Hits, stamp: int
) -> int:
    """Find the receivers whose sphere a segment of a ray crosses.

    Traverses the grid of columns (Amanatides and Woo, Eurographics 1987).

    Parameters
    ----------
    position, direction : array, shape (3,)
        Start of the segment in metres, and unit vector.
    length : float
        Metres.
    receivers : Receivers
        Spheres in their columns.
    hits : Hits
        Takes the index, chord length and chord midpoint of each.
    stamp : int
        Number of the segment. It marks receivers that have been tested, since a sphere may lie
        in several columns.

    Returns
    -------
    int
        Number of receivers that are hit.
    """
    box, cell, shape = receivers.box, receivers.cell, receivers.shape
    centres, radius = receivers.centres, receivers.radius
    near, far = 0.0, length
    for axis in range(3):
        near, far = _clip(box[0, axis], box[1, axis], position[axis], direction[axis], near, far)
    count = 0
    if near >= far:
        return count
    # Column in which the traversal starts, and distances along the ray to the next grid lines.
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
        column = ix * shape[1] + iy
        for entry in range(receivers.starts[column], receivers.starts[column + 1]):
            receiver = receivers.members[entry]
            if hits.last_stamp[receiver] == stamp:
                continue
            hits.last_stamp[receiver] = stamp
            dx = centres[receiver, 0] - position[0]
            dy = centres[receiver, 1] - position[1]
            dz = centres[receiver, 2] - position[2]
            along = dx * direction[0] + dy * direction[1] + dz * direction[2]
            half = radius * radius - (dx * dx + dy * dy + dz * dz - along * along)
            if half <= 0.0:
                continue
            half = math.sqrt(half)
            enter, leave = max(along - half, 0.0), min(along + half, length)
            if leave > enter:
                hits.receivers[count] = receiver
                hits.chords[count] = leave - enter
                hits.midpoints[count] = 0.5 * (enter + leave)
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
