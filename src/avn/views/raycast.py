"""`renderer=raycast`: ray casting with Embree, and light baked once per apartment."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan
from avn.views import shading
from avn.views.light_points import choose_points, normals_of
from avn.views.lighting import bake
from avn.views.mesh import BUILDING, split
from avn.views.ray_camera import RayCamera
from avn.views.rays import Triangles
from avn.views.renderer import Prepared, Renderer, check_light, check_range
from avn.views.scene_mesh import scene_mesh
from avn.views.settings import RaycastConfig, RendererConfig

# Pyramid level of a texture from which the albedo of a triangle is sampled.
_COARSE = 4
# Log-average luminance to which images are exposed.
_KEY = 0.42


class Raycast(Renderer):
    """Renderer that casts rays and looks up baked irradiance.

    See `Renderer` for the parameters.
    """

    def __init__(
        self,
        cfg: RaycastConfig,
        plan: FloorPlan,
        part: str,
        appearance_seed: int = 0,
        prepared: Prepared | None = None,
    ) -> None:
        self.cfg = cfg
        self.scene = scene_mesh(plan, part, appearance_seed)
        # longest edge: the diagonal of a cell of the grid that light is baked on
        self.mesh, origin = split(self.scene.mesh, cfg.light.spacing * math.sqrt(2))
        self.emission = np.ascontiguousarray(self.scene.emission[origin])
        self.occluder = self.scene.occluder[origin]
        self.normal, self.area = normals_of(self.mesh.vertices)
        self.pyramids = shading.pyramids(self.mesh.textures)
        self._prepared = prepared
        self._lookup = (
            self.pyramids.texels,
            self.pyramids.start,
            self.pyramids.height,
            self.pyramids.width,
            shading.LINEAR,
        )
        self._density = self._texel_density()
        self._camera = RayCamera(cfg.camera, Triangles(self.mesh.vertices), cfg.samples)

    @classmethod
    def check(cls, cfg: RendererConfig) -> None:
        """See `Renderer.check`."""
        super().check(cfg)
        assert isinstance(cfg, RaycastConfig)
        check_range("samples", cfg.samples, 1, 16)
        check_light(cfg.light)

    def _texel_density(self) -> NDArray[np.float32]:
        """Compute the texels per metre of each triangle, (T,)."""
        uv = self.mesh.uv.astype(np.float64)
        a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        covered = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
        if len(self.mesh.textures):
            sizes = self.pyramids.height[:, 0] * self.pyramids.width[:, 0]
            covered = covered * np.where(self.mesh.texture >= 0, sizes[self.mesh.texture], 0)
        density: NDArray[np.float32] = np.sqrt(covered / np.maximum(self.area, 1e-12)).astype(
            np.float32
        )
        return density

    def albedo(self) -> NDArray[np.float32]:
        """Compute the linear RGB albedo of each triangle near its centre, (T, 3)."""
        middle = np.ascontiguousarray(self.mesh.uv.mean(axis=1))
        found: NDArray[np.float32] = shading.sample(
            middle, self.mesh.texture, self.mesh.colour, _COARSE, *self._lookup
        )
        return found

    def prepare(self) -> Prepared:
        """Bake the irradiance at all vertices, and compute the exposure.

        Returns
        -------
        dict of arrays
            `light`, as `bake` returns it; `corner`, see `Points`; `exposure`, a scalar.
        """
        if self._prepared is None:
            albedo = self.albedo()
            points = choose_points(self.mesh, self.cfg.light.spacing)
            light = bake(
                self.mesh,
                albedo,
                self.occluder,
                self.scene.lamps,
                self.scene.panes,
                self.cfg.light,
                points,
            )
            exposure = self._exposure(albedo, light[0][points.corner])
            self._prepared = {
                "light": light,
                "corner": points.corner,
                "exposure": np.array(exposure),
            }
        return self._prepared

    def _exposure(self, albedo: NDArray[np.float32], light: NDArray[np.float32]) -> float:
        """Compute the exposure that brings the building's log-average luminance to `_KEY`.

        Reinhard et al., "Photographic tone reproduction for digital images", SIGGRAPH 2002,
        equations 1 and 2. `light` is the irradiance at the corners of each triangle, (T, 3, 3).
        """
        own = (self.mesh.piece == BUILDING) & (self.emission.max(axis=1) == 0)
        irradiance = light[own].mean(axis=1)
        bright = (albedo[own] * irradiance / np.pi) @ np.array((0.2126, 0.7152, 0.0722))
        logs = np.log(np.maximum(bright, 1e-4))
        return _KEY / float(np.exp(np.average(logs, weights=self.area[own])))

    def views(
        self, centres: NDArray[np.float64], headings: NDArray[np.int64]
    ) -> tuple[NDArray[np.uint8], NDArray[np.float16]]:
        """See `Renderer.views`."""
        prepared = self.prepare()
        size = self.cfg.camera.size
        rgb = np.empty((len(centres), size, size, 3), dtype=np.uint8)
        depth = np.empty((len(centres), size, size), dtype=np.float16)
        for n, (centre, heading) in enumerate(zip(centres, headings, strict=True)):
            hits = self._camera.cast(centre, heading)
            seen = shading.shade(
                hits.triangle,
                hits.u,
                hits.v,
                hits.distance,
                self._camera.rays[heading],
                self.cfg.samples**2,
                self._camera.pixel,
                self.normal,
                self._density,
                self.mesh.uv,
                self.mesh.texture,
                self.mesh.colour,
                self.emission,
                prepared["corner"],
                prepared["light"],
                *self._lookup,
                float(prepared["exposure"]),
            )
            rgb[n] = shading.encode(seen).reshape(size, size, 3)
            depth[n] = self._camera.depth(centre, heading)
        return rgb, depth
