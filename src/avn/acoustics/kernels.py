"""What a ray meets and where it goes on to: compiled.

Random numbers come from a hash of (seed, ray, bounce), so results depend neither on threads nor on
the order of work.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

_A = np.uint64(0x9E3779B97F4A7C15)
_B = np.uint64(0xBF58476D1CE4E5B9)
_C = np.uint64(0x94D049BB133111EB)
_NEAR = 1e-7  # metres: a ray does not meet again the surface that it has just left


@njit(cache=True, inline="always")
def _mix(state):  # type: ignore[no-untyped-def]
    """The finaliser of splitmix64 (Steele, Lea and Flood, OOPSLA 2014)."""
    state = (state ^ (state >> np.uint64(30))) * _B
    state = (state ^ (state >> np.uint64(27))) * _C
    return state ^ (state >> np.uint64(31))


@njit(cache=True)
def uniform(seed: int, ray: int, bounce: int, draw: int) -> float:
    """A number in [0, 1) that is a pure function of the four integers."""
    state = _mix(np.uint64(seed) + _A)
    state = _mix(state + np.uint64(ray) * _A)
    state = _mix(state + np.uint64(bounce) * _A)
    state = _mix(state + np.uint64(draw) * _A)
    return float(state >> np.uint64(11)) * (1.0 / 9007199254740992.0)


class Room(NamedTuple):
    """Rectangles grouped by the axis of their normal and sorted by offset within a group.

    `starts` (4,) bounds the groups; `axis`, `offset` (Q,), `lower`, `upper` (Q, 2) are those of
    `avn.apartments.surfaces`; `reflection` and `scattering` (Q, 6) are shares of energy,
    `mean_scattering` (Q,) is the mean over the bands.
    """

    starts: NDArray[np.int64]
    axis: NDArray[np.int64]
    offset: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    reflection: NDArray[np.float64]
    scattering: NDArray[np.float64]
    mean_scattering: NDArray[np.float64]


def plan_bounds(room: Room) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The least and the greatest x and y of all rectangles, (2,) each."""
    corners = np.concatenate(
        [
            np.insert(side[room.axis == axis], axis, room.offset[room.axis == axis], axis=1)
            for side in (room.lower, room.upper)
            for axis in range(3)
        ]
    )
    return corners.min(axis=0)[:2], corners.max(axis=0)[:2]


@njit(cache=True)
def nearest_hit(position, direction, room: Room) -> tuple[float, int]:  # type: ignore[no-untyped-def]
    """Distance to, and index of, the first rectangle that a ray meets; (inf, -1) if none.

    Each group of rectangles is walked away from the ray's origin and left as soon as it lies
    behind what has been found.
    """
    starts, offset, lower, upper = room.starts, room.offset, room.lower, room.upper
    best = math.inf
    found = -1
    for axis in range(3):
        slope = direction[axis]
        if abs(slope) < 1e-12:
            continue
        first, last = starts[axis], starts[axis + 1]
        u, v = (1, 2) if axis == 0 else ((0, 2) if axis == 1 else (0, 1))
        here = position[axis]
        inverse = 1.0 / slope
        split = first + np.searchsorted(offset[first:last], here)
        step = 1 if slope > 0 else -1
        # An offset equal to `here` lies at `split`; the test against _NEAR sorts it out.
        quad = split if slope > 0 else min(split, last - 1)
        while first <= quad < last:
            reach = (offset[quad] - here) * inverse
            if reach >= best:
                break
            if reach > _NEAR:
                a = position[u] + reach * direction[u]
                b = position[v] + reach * direction[v]
                if lower[quad, 0] <= a <= upper[quad, 0] and lower[quad, 1] <= b <= upper[quad, 1]:
                    best = reach
                    found = quad
            quad += step
    return best, found


@njit(cache=True)
def reflect(direction, axis: int, specular: bool, first: float, second: float) -> None:  # type: ignore[no-untyped-def]
    """Turn a ray in place at a surface: mirrored, or after Lambert's cosine law."""
    side = -1.0 if direction[axis] > 0 else 1.0
    if specular:
        direction[axis] = -direction[axis]
        return
    radius = math.sqrt(first)
    angle = 2 * math.pi * second
    u, v = (1, 2) if axis == 0 else ((0, 2) if axis == 1 else (0, 1))
    direction[u] = radius * math.cos(angle)
    direction[v] = radius * math.sin(angle)
    direction[axis] = side * math.sqrt(1.0 - first)
