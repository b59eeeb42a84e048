"""Compiled loops of the baking of light: rays to cast, and sums over what they met."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from avn.views.light_points import LIFT

_SEED_DIRECT = 1
_SEED_GATHER = 2


@numba.njit(cache=True)
def _random(seed: int, point: int, draw: int) -> float:
    """A number in [0, 1) for each point and draw: SplitMix64 as a hash."""
    x = np.uint64(seed) * np.uint64(0xD1342543DE82EF95) + np.uint64(point)
    x = x * np.uint64(0x9E3779B97F4A7C15) + np.uint64(draw)
    for _ in range(2):
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x = x ^ (x >> np.uint64(31))
    return (x >> np.uint64(11)) * 2.0**-53


# Fractions of the plastic number: a lattice that fills the square evenly (M. Roberts, 2018).
_R2_A, _R2_B = 0.7548776662466927, 0.5698402909980532


@numba.njit(cache=True)
def shadow_rays(
    place: NDArray[np.float32],
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
    lamps, panes = len(lamp_centre), len(corner)
    most = len(place) * (lamps + panes) * rays
    origin = np.empty((most, 3), dtype=np.float32)
    direction = np.empty((most, 3), dtype=np.float32)
    distance = np.empty(most, dtype=np.float32)
    light = np.empty((most, 3), dtype=np.float32)
    owner = np.empty(most, dtype=np.int32)
    n = 0
    to = np.empty(3)
    for p in range(len(place)):
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
                    behind += (place[p, i] - corner[pane, i]) * pane_normal[pane, i]
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
                    to[i] -= place[p, i]
                    square += to[i] * to[i]
                    facing += to[i] * normal[p, i]
                    if pane >= 0:
                        leaving -= to[i] * pane_normal[pane, i]
                if facing <= 0.0 or square < 1e-6:
                    continue
                far = np.sqrt(square)
                if pane < 0:
                    # a sphere of uniform brightness shines like a point in its middle
                    share = facing / far / max(square, 0.01) / rays
                else:
                    share = facing / far * leaving / far / max(square, 0.01) * area / rays
                for i in range(3):
                    origin[n, i] = place[p, i]
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
def add(
    found: NDArray[np.float32],
    owner: NDArray[np.int32],
    light: NDArray[np.float32],
    blocked: NDArray[np.bool_],
) -> None:
    for n in range(len(owner)):
        if not blocked[n]:
            for i in range(3):
                found[owner[n], i] += light[n, i]


@numba.njit(cache=True)
def cosine_rays(
    normal: NDArray[np.float32], numbers: NDArray[np.int64], first: int, last: int
) -> NDArray[np.float32]:
    rays = last - first
    out = np.empty((len(normal) * rays, 3), dtype=np.float32)
    for p in range(len(normal)):
        x, y, z = normal[p]
        # a frame about the normal (T. Duff et al., JCGT 6(1), 2017)
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


@numba.njit(cache=True)
def bounce(
    seen: NDArray[np.int32],
    light: NDArray[np.float32],
    albedo: NDArray[np.float32],
    front: NDArray[np.int32],
    back: NDArray[np.int32],
) -> NDArray[np.float32]:
    """Irradiance (P, 3) at points from what lies before them, lit with `light`."""
    out = np.zeros_like(light)
    for p in range(len(seen)):
        for ray in range(seen.shape[1]):
            face = seen[p, ray]
            if face < 0:
                continue
            triangle = face // 2
            point = front[triangle] if face % 2 == 0 else back[triangle]
            if point < 0:
                continue
            for i in range(3):
                out[p, i] += albedo[triangle, i] * light[point, i]
        for i in range(3):
            out[p, i] /= seen.shape[1]
    return out


@numba.njit(cache=True)
def to_corners(
    light: NDArray[np.float32],
    side: NDArray[np.int32],
    corner: NDArray[np.int32],
    weights: NDArray[np.float32],
) -> NDArray[np.float32]:
    """The mean at each corner of the triangles about it, weighted by area."""
    count = corner.max() + 1
    total = np.zeros((count, 3))
    weight = np.zeros(count)
    for t in range(len(corner)):
        if side[t] < 0:
            continue
        for k in range(3):
            c = corner[t, k]
            weight[c] += weights[t]
            for i in range(3):
                total[c, i] += weights[t] * light[side[t], i]
    out = np.zeros((count, 3), dtype=np.float32)
    for c in range(count):
        if weight[c] > 0:
            for i in range(3):
                out[c, i] = total[c, i] / weight[c]
    return out


@numba.njit(cache=True)
def smooth(
    values: NDArray[np.float32],
    side: NDArray[np.int32],
    corner: NDArray[np.int32],
    weights: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Each corner as the mean of its triangles' means."""
    total = np.zeros(values.shape)
    weight = np.zeros(len(values))
    for t in range(len(corner)):
        if side[t] < 0:
            continue
        for i in range(3):
            mean = (values[corner[t, 0], i] + values[corner[t, 1], i] + values[corner[t, 2], i]) / 3
            for k in range(3):
                total[corner[t, k], i] += weights[t] * mean
        for k in range(3):
            weight[corner[t, k]] += weights[t]
    out = np.zeros_like(values)
    for c in range(len(values)):
        if weight[c] > 0:
            for i in range(3):
                out[c, i] = total[c, i] / weight[c]
    return out
