"""Intersection and reflection of rays, compiled by Numba.

Random numbers are a hash of (seed, ray, bounce, draw), so results depend neither on threads nor on
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
_NEAR = 1e-7  # metres: a ray does not hit the surface again that it has just left


@njit(cache=True, inline="always")
def _mix(state):  # type: ignore[no-untyped-def]
    """Apply the finaliser of splitmix64 (Steele, Lea and Flood, OOPSLA 2014)."""
    state = (state ^ (state >> np.uint64(30))) * _B
    state = (state ^ (state >> np.uint64(27))) * _C
    return state ^ (state >> np.uint64(31))


@njit(cache=True)
def uniform(seed: int, ray: int, bounce: int, draw: int) -> float:
    """Return a uniform random number in [0, 1), a pure function of four integers.

    Parameters
    ----------
    seed, ray, bounce, draw : int
        Words of the hash; `draw` numbers the draws at one reflection.
    """
    state = _mix(np.uint64(seed) + _A)
    state = _mix(state + np.uint64(ray) * _A)
    state = _mix(state + np.uint64(bounce) * _A)
    state = _mix(state + np.uint64(draw) * _A)
    return float(state >> np.uint64(11)) * (1.0 / 9007199254740992.0)


class SortedSurfaces(NamedTuple):
    """Rectangles grouped by the axis of their normal and sorted by offset within a group.

    Attributes
    ----------
    starts : (4,) int64
        Bounds of the three groups.
    axis, offset : (Q,)
        As in `avn.apartments.surfaces.Surfaces`; offsets in metres.
    lower, upper : (Q, 2) float64
        As in `avn.apartments.surfaces.Surfaces`, metres.
    reflection, scattering : (Q, 6) float64
        Share of the energy that is reflected, and share of the reflected energy that is scattered.
    mean_scattering : (Q,) float64
        Mean over the bands.
    """

    starts: NDArray[np.int64]
    axis: NDArray[np.int64]
    offset: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    reflection: NDArray[np.float64]
    scattering: NDArray[np.float64]
    mean_scattering: NDArray[np.float64]


def plan_bounds(surfaces: SortedSurfaces) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the least and the greatest x and y of all rectangles, (2,) each, metres."""
    corners = np.concatenate(
        [
            np.insert(
                side[surfaces.axis == axis], axis, surfaces.offset[surfaces.axis == axis], axis=1
            )
            for side in (surfaces.lower, surfaces.upper)
            for axis in range(3)
        ]
    )
    return corners.min(axis=0)[:2], corners.max(axis=0)[:2]


@njit(cache=True)
def nearest_hit(position, direction, surfaces: SortedSurfaces) -> tuple[float, int]:  # type: ignore[no-untyped-def]
    """Find the first rectangle that a ray hits.

    Each group of rectangles is searched outwards from the ray's origin, until it is farther than
    the nearest hit so far.

    Parameters
    ----------
    position, direction : array, shape (3,)
        Origin in metres, and unit vector.
    surfaces : SortedSurfaces
        Reflecting rectangles.

    Returns
    -------
    distance : float
        Metres; infinite if there is no hit.
    index : int
        Index of the rectangle; -1 if there is no hit.
    """
    starts, offset, lower, upper = surfaces.starts, surfaces.offset, surfaces.lower, surfaces.upper
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
    """Reflect a ray's direction in place: specularly, or after Lambert's cosine law.

    Parameters
    ----------
    direction : array, shape (3,)
        Unit vector; changed in place.
    axis : int
        Axis of the surface's normal.
    specular : bool
        True for a specular reflection.
    first, second : float
        Uniform random numbers in [0, 1) that give the direction of a diffuse reflection.
    """
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
