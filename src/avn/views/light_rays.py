"""Compiled generation of the rays of light baking: shadow rays and cosine-distributed rays."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from avn.views.light_points import LIFT

_SEED_DIRECT = 1
_SEED_GATHER = 2


@numba.njit(cache=True)
def _random(seed: int, point: int, draw: int) -> float:
    """Hash point and draw to a number in [0, 1).

    The mixing steps are those of SplitMix64: Steele, Lea and Flood, "Fast splittable pseudorandom
    number generators", OOPSLA 2014.
    """
    x = np.uint64(seed) * np.uint64(0xD1342543DE82EF95) + np.uint64(point)
    x = x * np.uint64(0x9E3779B97F4A7C15) + np.uint64(draw)
    for _ in range(2):
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x = x ^ (x >> np.uint64(31))
    return (x >> np.uint64(11)) * 2.0**-53


# Inverse powers of the plastic number: the R2 low-discrepancy sequence (M. Roberts, 2018).
_R2_A, _R2_B = 0.7548776662466927, 0.5698402909980532


@numba.njit(cache=True)
def shadow_rays(
    position: NDArray[np.float32],
    normal: NDArray[np.float32],
    start: int,
    lamp_centre: NDArray[np.float64],
    lamp_radius: float,
    lamp_intensity: NDArray[np.float64],
    corner: NDArray[np.float64],
    side_a: NDArray[np.float64],
    side_b: NDArray[np.float64],
    pane_normal: NDArray[np.float64],
    radiance: NDArray[np.float64],
    rays: int,
) -> tuple[
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.int32],
]:
    """Generate the shadow rays of P points towards all light sources.

    Rays towards sources below the horizon of a point or behind a pane are left out.

    Parameters
    ----------
    position, normal : (P, 3) float32
        Metres, and unit vectors.
    start : int
        Number of the first point, which seeds the random offsets.
    lamp_centre : (L, 3) float64
        Metres.
    lamp_radius : float
        Metres.
    lamp_intensity : (L, 3) float64
        Linear RGB.
    corner, side_a, side_b : (Q, 3) float64
        A corner and the two edges of each window pane, metres.
    pane_normal : (Q, 3) float64
        Unit vectors into the room.
    radiance : (Q, 3) float64
        Linear RGB of the panes.
    rays : int
        Rays per point and source.

    Returns
    -------
    origin, direction : (N, 3) float32
        Metres, and unit vectors.
    distance : (N,) float32
        Metres to the source, less a margin.
    light : (N, 3) float32
        Irradiance that the ray adds if it is not occluded.
    owner : (N,) int32
        Point of each ray.
    """
    lamps, panes = len(lamp_centre), len(corner)
    most = len(position) * (lamps + panes) * rays
    origin = np.empty((most, 3), dtype=np.float32)
    direction = np.empty((most, 3), dtype=np.float32)
    distance = np.empty(most, dtype=np.float32)
    light = np.empty((most, 3), dtype=np.float32)
    owner = np.empty(most, dtype=np.int32)
    n = 0
    to = np.empty(3)
    for p in range(len(position)):
        for source in range(lamps + panes):
            turn_a = _random(_SEED_DIRECT, start + p, 2 * source)
            turn_b = _random(_SEED_DIRECT, start + p, 2 * source + 1)
            pane = source - lamps
            if pane >= 0:
                area = 0.0
                behind = 0.0
                for i in range(3):
                    j, k = (i + 1) % 3, (i + 2) % 3
                    part = side_a[pane, j] * side_b[pane, k] - side_a[pane, k] * side_b[pane, j]
                    area += part * part
                    behind += (position[p, i] - corner[pane, i]) * pane_normal[pane, i]
                area = np.sqrt(area)
                if behind <= 0.0:
                    continue
            for ray in range(rays):
                a = (turn_a + ray * _R2_A) % 1.0
                b = (turn_b + ray * _R2_B) % 1.0
                if pane < 0:
                    z = 1.0 - 2.0 * a
                    r = np.sqrt(max(0.0, 1.0 - z * z))
                    to[0] = lamp_centre[source, 0] + lamp_radius * r * np.cos(2 * np.pi * b)
                    to[1] = lamp_centre[source, 1] + lamp_radius * r * np.sin(2 * np.pi * b)
                    to[2] = lamp_centre[source, 2] + lamp_radius * z
                else:
                    for i in range(3):
                        to[i] = corner[pane, i] + a * side_a[pane, i] + b * side_b[pane, i]
                square, facing, leaving = 0.0, 0.0, 0.0
                for i in range(3):
                    to[i] -= position[p, i]
                    square += to[i] * to[i]
                    facing += to[i] * normal[p, i]
                    if pane >= 0:
                        leaving -= to[i] * pane_normal[pane, i]
                if facing <= 0.0 or square < 1e-6:
                    continue
                far = np.sqrt(square)
                if pane < 0:
                    # a sphere of uniform radiance irradiates like a point at its centre
                    share = facing / far / max(square, 0.01) / rays
                else:
                    share = facing / far * leaving / far / max(square, 0.01) * area / rays
                for i in range(3):
                    origin[n, i] = position[p, i]
                    direction[n, i] = to[i] / far
                    if pane < 0:
                        light[n, i] = share * lamp_intensity[source, i]
                    else:
                        light[n, i] = share * radiance[pane, i]
                distance[n] = far - 2 * LIFT
                owner[n] = p
                n += 1
    return origin[:n], direction[:n], distance[:n], light[:n], owner[:n]


@numba.njit(cache=True)
def cosine_rays(
    normal: NDArray[np.float32], numbers: NDArray[np.int64], first: int, last: int
) -> NDArray[np.float32]:
    """Sample cosine-distributed directions over the hemisphere of each point.

    Parameters
    ----------
    normal : (P, 3) float32
        Unit vectors.
    numbers : (P,) int64
        Numbers of the points, which seed the random offsets.
    first, last : int
        Range of the rays of each point's sequence.

    Returns
    -------
    (P * (last - first), 3) float32
        Unit vectors, point by point.
    """
    rays = last - first
    out = np.empty((len(normal) * rays, 3), dtype=np.float32)
    for p in range(len(normal)):
        x, y, z = normal[p]
        # orthonormal basis of the normal (T. Duff et al., JCGT 6(1), 2017)
        sign = 1.0 if z >= 0 else -1.0
        a = -1.0 / (sign + z)
        b = x * y * a
        turn_a = _random(_SEED_GATHER, numbers[p], 0)
        turn_b = _random(_SEED_GATHER, numbers[p], 1)
        for ray in range(first, last):
            s = (turn_a + ray * _R2_A) % 1.0
            angle = 2 * np.pi * ((turn_b + ray * _R2_B) % 1.0)
            r, up = np.sqrt(s), np.sqrt(1.0 - s)
            u, v = r * np.cos(angle), r * np.sin(angle)
            n = p * rays + ray - first
            out[n, 0] = u * (1.0 + sign * x * x * a) + v * b + up * x
            out[n, 1] = u * sign * b + v * (sign + y * y * a) + up * y
            out[n, 2] = -u * sign * x - v * y + up * z
    return out
