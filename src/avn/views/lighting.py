"""Light that is baked once an apartment: the irradiance at every corner of every triangle.

Direct light comes from spheres and rectangles by shadow rays; light that surfaces pass on is
gathered with one set of rays, cosine-distributed over the hemisphere, whose hits are kept, so
that each further bounce is a sum (the radiosity equation, J. T. Kajiya, "The rendering equation",
SIGGRAPH 1986, for matt surfaces). Triangles that lie close together and face the same way share
one point; what is found there is spread to their corners, which also smooths it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from avn.views.lights import Lamps, Panes
from avn.views.mesh import BUILDING, Mesh
from avn.views.rays import Triangles

# Lift-off of rays from their surface, metres.
LIFT = 1e-3
# Points that are worked on at once: bounds the memory.
_AT_ONCE = 1 << 20
# Rays that tell whether a point is walled in: all end within so many metres.
_FEW = 12
_NARROW = 0.5
_SEED_DIRECT = 1
_SEED_GATHER = 2


@dataclass
class LightConfig:
    """How finely light is baked.

    Attributes
    ----------
    spacing : float
        Metres between points that light is gathered at.
    shadow_rays : int
        For each point and source of light.
    gather_rays : int
        For each point.
    bounces : int
        How often light is passed on.
    smoothing : int
        How often what is passed on is averaged with its surroundings.
    """

    spacing: float = 0.07
    shadow_rays: int = 12
    gather_rays: int = 64
    bounces: int = 5
    smoothing: int = 2


@dataclass(frozen=True)
class Points:
    """Where light is gathered, and which triangles are lit from there.

    Attributes
    ----------
    place, normal : (P, 3) float32
        The first `fronts` stand before front faces, the others behind back faces.
    fronts : int
    front : (T,) int32
        Point of each triangle's front face.
    back : (T,) int32
        Point of its back face; -1 for the building, whose back is never seen.
    corner : (T, 3) int32
        Number of the corner: triangles that share it and face the same way have it in common.
    """

    place: NDArray[np.float32]
    normal: NDArray[np.float32]
    front: NDArray[np.int32]
    back: NDArray[np.int32]
    corner: NDArray[np.int32]


def _numbered(*columns: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First row and number of each distinct row of some columns."""
    key = np.zeros(len(columns[0]), dtype=np.uint64)
    for column in columns:
        key = (key ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    return first, number


def _first(
    number: NDArray[np.int64], rank: NDArray[np.float64], area: NDArray[np.float32]
) -> NDArray[np.int64]:
    """Of each group the triangle of least rank, and of those the largest.

    Models hide sheets close under others: what stands out farthest is what is seen.
    """
    order = np.lexsort((-area, rank, number))
    return order[np.flatnonzero(np.diff(number[order], prepend=-1))]


def normals_of(vertices: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Unit normals (T, 3) and areas (T,) of triangles; those without an area look up."""
    v = vertices.astype(np.float64)
    cross = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    length = np.linalg.norm(cross, axis=1)
    flat = length < 1e-14
    normal = np.where(flat[:, None], (0.0, 0.0, 1.0), cross / np.where(flat, 1.0, length)[:, None])
    return normal.astype(np.float32), (length / 2).astype(np.float32)


def choose_points(mesh: Mesh, spacing: float) -> Points:
    """Group triangles that lie within `spacing` and face the same way."""
    normal, area = normals_of(mesh.vertices)
    centre = mesh.vertices.astype(np.float64).mean(axis=1)
    height = (centre * normal).sum(axis=1)
    facing = np.rint(normal * 2).astype(np.int64)
    voxel = np.floor(centre / spacing).astype(np.int64)
    # two faces of a board are apart by its thickness only
    layer = np.floor(height / 0.01 + 0.5).astype(np.int64)
    _, number = _numbered(*voxel.T, *facing.T, layer)
    outer, inmost = (_first(number, np.rint(sign * height / 0.002), area) for sign in (-1, 1))
    front = number.astype(np.int32)
    inner = mesh.piece != BUILDING
    sides, back_of = np.unique(number[inner], return_inverse=True)
    back = np.full(len(mesh), -1, dtype=np.int32)
    back[inner] = len(outer) + back_of
    inmost = inmost[sides]
    fronts, backs = normal[outer], -normal[inmost]
    place = np.concatenate((centre[outer], centre[inmost]))
    along = np.concatenate((fronts, backs))
    corners = np.rint(mesh.vertices.reshape(-1, 3).astype(np.float64) * 1000).astype(np.int64)
    _, corner = _numbered(*corners.T, *np.repeat(facing, 3, axis=0).T)
    return Points(
        (place + LIFT * along).astype(np.float32),
        along.astype(np.float32),
        front,
        back,
        corner.reshape(-1, 3).astype(np.int32),
    )


def bake(
    mesh: Mesh,
    albedo: NDArray[np.float32],
    shade: NDArray[np.bool_],
    lamps: Lamps,
    panes: Panes,
    cfg: LightConfig,
    points: Points,
) -> NDArray[np.float32]:
    """Irradiance at the corners of a mesh.

    Parameters
    ----------
    mesh : Mesh
        T triangles, none much longer than `cfg.spacing`.
    albedo : (T, 3) float32
    shade : (T,) bool
        Which triangles keep light off others.
    lamps, panes : Lamps, Panes
    cfg : LightConfig
    points : Points
        From `choose_points`.

    Returns
    -------
    (2, V, 3) float32
        Linear RGB before and behind each corner of `points.corner`.
    """
    solid = np.flatnonzero(shade)
    triangles = Triangles(mesh.vertices[solid])
    normal, area = normals_of(mesh.vertices)
    direct = _direct(triangles, points, lamps, panes, cfg.shadow_rays)
    seen = _gather(triangles, solid, normal, points, cfg.gather_rays)
    passed = np.zeros_like(direct)
    for _ in range(cfg.bounces):
        passed = _bounce(seen, direct + passed, albedo, points.front, points.back)
    weights = np.maximum(area, 1e-8)
    baked = []
    for side in (points.front, points.back):
        sharp = _to_corners(direct, side, points.corner, weights)
        soft = _to_corners(passed, side, points.corner, weights)
        for _ in range(cfg.smoothing):
            soft = _smooth(soft, side, points.corner, weights)
        baked.append(sharp + soft)
    return np.stack(baked).astype(np.float32)


def _direct(
    triangles: Triangles, points: Points, lamps: Lamps, panes: Panes, rays: int
) -> NDArray[np.float32]:
    found = np.zeros((len(points.place), 3), dtype=np.float32)
    sources = (len(lamps.centre) + len(panes.corner)) * rays
    if not sources:
        return found
    step = max(1, _AT_ONCE // sources)
    for start in range(0, len(found), step):
        rows = slice(start, start + step)
        origin, direction, distance, light, owner = _shadow_rays(
            points.place[rows],
            points.normal[rows],
            start,
            lamps.centre,
            lamps.radius,
            lamps.intensity,
            panes.corner,
            panes.side_a,
            panes.side_b,
            panes.normal,
            panes.radiance,
            rays,
        )
        blocked = triangles.blocked(origin, direction, distance)
        _add(found[rows], owner, light, blocked)
    return found


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
def _shadow_rays(
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
def _add(
    found: NDArray[np.float32],
    owner: NDArray[np.int32],
    light: NDArray[np.float32],
    blocked: NDArray[np.bool_],
) -> None:
    for n in range(len(owner)):
        if not blocked[n]:
            for i in range(3):
                found[owner[n], i] += light[n, i]


def _gather(
    triangles: Triangles,
    solid: NDArray[np.int64],
    normal: NDArray[np.float32],
    points: Points,
    rays: int,
) -> NDArray[np.int32]:
    """Which face each point sees along each ray, (P, rays): 2 t before, 2 t + 1 behind, -1 none.

    Where the first few rays get nowhere (the insides of furniture) they stand for the others.
    """
    seen = np.empty((len(points.place), rays), dtype=np.int32)
    few = min(_FEW, rays)
    step = max(1, _AT_ONCE // rays)
    for start in range(0, len(seen), step):
        numbers = np.arange(start, min(start + step, len(seen)))
        found, far = _look(triangles, solid, normal, points, numbers, 0, few)
        seen[numbers] = np.resize(found.T, (rays, len(numbers))).T
        open_ = numbers[far.max(axis=1) > _NARROW]
        if few < rays:
            seen[open_, few:] = _look(triangles, solid, normal, points, open_, few, rays)[0]
    return seen


def _look(
    triangles: Triangles,
    solid: NDArray[np.int64],
    normal: NDArray[np.float32],
    points: Points,
    numbers: NDArray[np.int64],
    first: int,
    last: int,
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Faces that some points see along rays `first` to `last`, and how far away they are."""
    directions = _cosine_rays(points.normal[numbers], numbers, first, last)
    origins = np.repeat(points.place[numbers], last - first, axis=0)
    hits = triangles.meet(origins, directions)
    met = solid[np.maximum(hits.triangle, 0)]
    behind = np.einsum("ni,ni->n", directions, normal[met]) > 0
    faces = np.where(hits.triangle < 0, -1, 2 * met + behind).astype(np.int32)
    shape = (len(numbers), last - first)
    return faces.reshape(shape), hits.distance.reshape(shape)


@numba.njit(cache=True)
def _cosine_rays(
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
def _bounce(
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
def _to_corners(
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
def _smooth(
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
