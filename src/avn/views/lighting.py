"""Light that is baked once an apartment: the irradiance at every corner of every triangle.

Direct light comes from spheres and rectangles by shadow rays; light that surfaces pass on is
gathered with one set of rays, cosine-distributed over the hemisphere, whose hits are kept, so
that each further bounce is a sum (the radiosity equation, J. T. Kajiya, "The rendering equation",
SIGGRAPH 1986, for matt surfaces). Triangles that lie close together and face the same way share
one point; what is found there is spread to their corners, which also smooths it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.views import light_kernels as kernels
from avn.views.light_points import Points, normals_of
from avn.views.lights import Lamps, Panes
from avn.views.mesh import Mesh
from avn.views.rays import Triangles

# Points that are worked on at once: bounds the memory.
_AT_ONCE = 1 << 20
# Rays that tell whether a point is walled in: all end within so many metres.
_FEW = 12
_NARROW = 0.5


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
        passed = kernels.bounce(seen, direct + passed, albedo, points.front, points.back)
    weights = np.maximum(area, 1e-8)
    baked = []
    for side in (points.front, points.back):
        sharp = kernels.to_corners(direct, side, points.corner, weights)
        soft = kernels.to_corners(passed, side, points.corner, weights)
        for _ in range(cfg.smoothing):
            soft = kernels.smooth(soft, side, points.corner, weights)
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
        origin, direction, distance, light, owner = kernels.shadow_rays(
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
        kernels.add(found[rows], owner, light, blocked)
    return found


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
    directions = kernels.cosine_rays(points.normal[numbers], numbers, first, last)
    origins = np.repeat(points.place[numbers], last - first, axis=0)
    hits = triangles.meet(origins, directions)
    met = solid[np.maximum(hits.triangle, 0)]
    behind = np.einsum("ni,ni->n", directions, normal[met]) > 0
    faces = np.where(hits.triangle < 0, -1, 2 * met + behind).astype(np.int32)
    shape = (len(numbers), last - first)
    return faces.reshape(shape), hits.distance.reshape(shape)
