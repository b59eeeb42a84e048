"""Light baking: irradiance at the vertices of an apartment's mesh.

Direct light of spheres and rectangles is sampled with shadow rays. Indirect light is gathered
with one set of cosine-distributed rays per point, whose hits are stored, so that each bounce is
a sum (J. T. Kajiya, "The rendering equation", SIGGRAPH 1986, for diffuse surfaces). Adjacent
triangles of similar orientation share one sample point. Its irradiance is averaged onto their
vertices, which also smooths it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.views import light_kernels as kernels
from avn.views import light_rays
from avn.views.light_points import Points, normals_of
from avn.views.lights import Lamps, Panes
from avn.views.mesh import Mesh
from avn.views.rays import Triangles
from avn.views.settings import LightConfig

# Rays that are processed at once, which bounds the memory.
_AT_ONCE = 1 << 20
# A point is enclosed if its first _FEW rays all end within _NARROW metres.
_FEW = 12
_NARROW = 0.5


def bake(
    mesh: Mesh,
    albedo: NDArray[np.float32],
    occluder: NDArray[np.bool_],
    lamps: Lamps,
    panes: Panes,
    cfg: LightConfig,
    points: Points,
) -> NDArray[np.float32]:
    """Bake the irradiance at the vertices of a mesh.

    Parameters
    ----------
    mesh : Mesh
        T triangles, with edges not much longer than `cfg.spacing`.
    albedo : (T, 3) float32
        Linear RGB.
    occluder : (T,) bool
        True for triangles that cast shadows.
    lamps : Lamps
    panes : Panes
    cfg : LightConfig
    points : Points
        Sample points; see `choose_points`.

    Returns
    -------
    (2, V, 3) float32
        Linear RGB irradiance on the front and back of each vertex of `points.corner`.
    """
    solid = np.flatnonzero(occluder)
    triangles = Triangles(mesh.vertices[solid])
    normal, area = normals_of(mesh.vertices)
    direct = _direct(triangles, points, lamps, panes, cfg.shadow_rays)
    hit_faces = _gather(triangles, solid, normal, points, cfg.gather_rays)
    indirect = np.zeros_like(direct)
    for _ in range(cfg.bounces):
        indirect = kernels.bounce(hit_faces, direct + indirect, albedo, points.front, points.back)
    weights = np.maximum(area, 1e-8)
    baked = []
    for side in (points.front, points.back):
        sharp = kernels.to_corners(direct, side, points.corner, weights)
        soft = kernels.to_corners(indirect, side, points.corner, weights)
        for _ in range(cfg.smoothing):
            soft = kernels.smooth(soft, side, points.corner, weights)
        baked.append(sharp + soft)
    return np.stack(baked).astype(np.float32)


def _direct(
    triangles: Triangles, points: Points, lamps: Lamps, panes: Panes, rays: int
) -> NDArray[np.float32]:
    found = np.zeros((len(points.position), 3), dtype=np.float32)
    sources = (len(lamps.centre) + len(panes.corner)) * rays
    if not sources:
        return found
    step = max(1, _AT_ONCE // sources)
    for start in range(0, len(found), step):
        rows = slice(start, start + step)
        origin, direction, distance, light, owner = light_rays.shadow_rays(
            points.position[rows],
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
        occluded = triangles.occluded(origin, direction, distance)
        kernels.add(found[rows], owner, light, occluded)
    return found


def _gather(
    triangles: Triangles,
    solid: NDArray[np.int64],
    normal: NDArray[np.float32],
    points: Points,
    rays: int,
) -> NDArray[np.int32]:
    """Find the face that each gather ray hits, (P, rays).

    2 t is the front of triangle t, 2 t + 1 its back, and -1 no hit. Enclosed points, such as
    those inside furniture, repeat their first few rays.
    """
    faces = np.empty((len(points.position), rays), dtype=np.int32)
    few = min(_FEW, rays)
    step = max(1, _AT_ONCE // rays)
    for start in range(0, len(faces), step):
        numbers = np.arange(start, min(start + step, len(faces)))
        found, far = _hit_faces(triangles, solid, normal, points, numbers, 0, few)
        faces[numbers] = np.resize(found.T, (rays, len(numbers))).T
        open_ = numbers[far.max(axis=1) > _NARROW]
        if few < rays:
            faces[open_, few:] = _hit_faces(triangles, solid, normal, points, open_, few, rays)[0]
    return faces


def _hit_faces(
    triangles: Triangles,
    solid: NDArray[np.int64],
    normal: NDArray[np.float32],
    points: Points,
    numbers: NDArray[np.int64],
    first: int,
    last: int,
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Find the faces and distances in metres that rays `first` to `last` of some points hit."""
    directions = light_rays.cosine_rays(points.normal[numbers], numbers, first, last)
    origins = np.repeat(points.position[numbers], last - first, axis=0)
    hits = triangles.intersect(origins, directions)
    met = solid[np.maximum(hits.triangle, 0)]
    behind = np.einsum("ni,ni->n", directions, normal[met]) > 0
    faces = np.where(hits.triangle < 0, -1, 2 * met + behind).astype(np.int32)
    shape = (len(numbers), last - first)
    return faces.reshape(shape), hits.distance.reshape(shape)
