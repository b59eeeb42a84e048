"""`renderer=cycles`: views path-traced by Blender Cycles (extra `render`).

Scene, light sources, camera and tone mapping are those of `renderer=raycast`. Cycles traces light
paths from each pixel, where `raycast` looks up baked irradiance.
"""

from __future__ import annotations

import dataclasses
import importlib
import importlib.util
import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan
from avn.core.errors import UserError
from avn.views import shading
from avn.views.ray_camera import RayCamera
from avn.views.raycast import Raycast
from avn.views.rays import Triangles
from avn.views.renderer import Prepared, Renderer, check_light, check_range
from avn.views.scene_mesh import SceneMesh, scene_mesh
from avn.views.settings import CyclesConfig, RaycastConfig, RendererConfig

_INSTALL = (
    "renderer=cycles: Blender's module bpy {}; `pip install 'avn[render]'`, on a bare Debian also "
    "libx11-6 libxext6 libxrender1 libxfixes3 libxi6 libxkbcommon0 libsm6 libice6 libgl1, or use "
    "renderer=raycast"
)


class Cycles(Renderer):
    """Renderer that path-traces views with Blender Cycles.

    See `Renderer` for the parameters.
    """

    # Blender has one scene a process; this is the renderer that it belongs to now.
    _owner: ClassVar[Cycles | None] = None

    def __init__(
        self,
        cfg: CyclesConfig,
        plan: FloorPlan,
        part: str,
        appearance_seed: int = 0,
        prepared: Prepared | None = None,
    ) -> None:
        self.check(cfg)
        self.cfg = cfg
        self._made_from = (plan, part, appearance_seed)
        self._scene = scene_mesh(plan, part, appearance_seed)
        self._prepared = prepared
        self._camera = RayCamera(cfg.camera, Triangles(self._scene.mesh.vertices))

    @classmethod
    def check(cls, cfg: RendererConfig) -> None:
        """See `Renderer.check`."""
        super().check(cfg)
        assert isinstance(cfg, CyclesConfig)
        check_range("samples", cfg.samples, 1, 65536)
        check_range("bounces", cfg.bounces, 0, 1024)
        check_light(cfg.light)
        if importlib.util.find_spec("bpy") is None:
            raise UserError(_INSTALL.format("is not installed"))

    def prepare(self) -> Prepared:
        """Compute the exposure of the apartment from coarsely baked light."""
        if self._prepared is None:
            light = dataclasses.replace(self.cfg.light, bounces=self.cfg.bounces)
            coarse = RaycastConfig(camera=self.cfg.camera, light=light)
            exposure = Raycast(coarse, *self._made_from).prepare()["exposure"]
            self._prepared = {"exposure": exposure}
        return self._prepared

    def views(
        self, centres: NDArray[np.float64], headings: NDArray[np.int64]
    ) -> tuple[NDArray[np.uint8], NDArray[np.float16]]:
        """See `Renderer.views`."""
        bpy = _blender()
        size = self.cfg.camera.size
        exposure = float(self.prepare()["exposure"])
        if Cycles._owner is not self:
            _build(bpy, self._scene, self.cfg, exposure)
            Cycles._owner = self
        camera = bpy.context.scene.camera
        rgb = np.empty((len(centres), size, size, 3), dtype=np.uint8)
        depth = np.empty((len(centres), size, size), dtype=np.float16)
        with tempfile.TemporaryDirectory() as folder:
            picture = Path(folder) / "view.exr"
            bpy.context.scene.render.filepath = str(picture)
            for n, (centre, heading) in enumerate(zip(centres, headings, strict=True)):
                camera.location = (*map(float, centre), self.cfg.camera.height)
                pitch = math.radians(90 + self.cfg.camera.pitch)
                camera.rotation_euler = (pitch, 0.0, -math.pi / 2 * int(heading))
                bpy.ops.render.render(write_still=True)
                shown = shading.tone_map_pixels(_pixels(bpy, picture, size) * np.float32(exposure))
                rgb[n] = shading.encode(shown).reshape(size, size, 3)
                depth[n] = self._camera.depth(centre, int(heading))
        return rgb, depth


def _blender() -> Any:
    try:
        return importlib.import_module("bpy")
    except ImportError as error:  # a library of the system is missing
        raise UserError(_INSTALL.format(f"cannot be loaded ({error})")) from error


def _pixels(bpy: Any, picture: Path, size: int) -> NDArray[np.float32]:
    """Read the linear RGB (size, size, 3) of a rendered file."""
    image = bpy.data.images.load(str(picture), check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    flat = np.empty(size * size * 4, dtype=np.float32)
    image.pixels.foreach_get(flat)
    bpy.data.images.remove(image)
    return np.ascontiguousarray(flat.reshape(size, size, 4)[::-1, :, :3])


def _build(bpy: Any, apartment: SceneMesh, cfg: CyclesConfig, exposure: float) -> None:
    """Reset Blender's scene and add an apartment, its light and the camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _settings(scene, cfg)
    scene.world = bpy.data.worlds.new("dark")
    _mesh(bpy, apartment, exposure)
    data = bpy.data.cameras.new("camera")
    data.angle = math.radians(cfg.camera.fov)
    data.clip_start, data.clip_end = 0.01, 100.0
    camera = bpy.data.objects.new("camera", data)
    scene.collection.objects.link(camera)
    scene.camera = camera


def _settings(scene: Any, cfg: CyclesConfig) -> None:
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = cfg.camera.size
    render.resolution_percentage = 100
    render.use_persistent_data = True
    render.threads_mode, render.threads = "FIXED", 1
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "NONE"
    scene.view_settings.view_transform = "Raw"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.seed = 0
    cycles.samples = cfg.samples
    cycles.use_adaptive_sampling = False
    cycles.use_light_tree = False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cfg.bounces
    cycles.sample_clamp_indirect = 0.0  # clamping would darken ceilings above lamps
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.use_denoising = cfg.denoise
    if cfg.denoise:
        cycles.denoiser = "OPENIMAGEDENOISE"
        cycles.denoising_prefilter = "ACCURATE"
        cycles.denoising_quality = "HIGH"


def _mesh(bpy: Any, apartment: SceneMesh, exposure: float) -> None:
    """Add an apartment as one object, with a material slot for each texture and emission."""
    mesh = apartment.mesh
    count = len(mesh)
    data = bpy.data.meshes.new("apartment")
    data.vertices.add(3 * count)
    data.vertices.foreach_set("co", mesh.vertices.ravel())
    data.loops.add(3 * count)
    data.loops.foreach_set("vertex_index", np.arange(3 * count, dtype=np.int32))
    data.polygons.add(count)
    data.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    own = (apartment.emission.max(axis=1) > 0) | (apartment.radiance.max(axis=1) > 0)
    kinds, slot = np.unique(2 * mesh.texture + own, return_inverse=True)
    data.polygons.foreach_set("material_index", slot.astype(np.int32).ravel())
    data.uv_layers.new(name="uv").data.foreach_set("uv", mesh.uv.ravel())
    # emission is given as exposed
    faces = {
        "colour": mesh.colour,
        "emission": apartment.emission / exposure,
        "radiance": apartment.radiance,
    }
    for name, values in faces.items():
        attribute = data.attributes.new(name, "FLOAT_VECTOR", "FACE")
        attribute.data.foreach_set("vector", np.ascontiguousarray(values, np.float32).ravel())
    pictures = list(_pictures(bpy, mesh.textures))
    for kind in kinds:
        texture, emits = int(kind) // 2, bool(kind % 2)
        data.materials.append(_material(bpy, pictures[texture] if texture >= 0 else None, emits))
    data.update()
    body = bpy.data.objects.new("apartment", data)
    bpy.context.scene.collection.objects.link(body)


def _pictures(bpy: Any, textures: tuple[NDArray[np.uint8], ...]) -> Iterator[Any]:
    for number, texture in enumerate(textures):
        height, width = texture.shape[:2]
        image = bpy.data.images.new(f"picture {number}", width, height)
        pixels = np.ones((height, width, 4), dtype=np.float32)
        pixels[..., :3] = texture[::-1] / np.float32(255)
        image.pixels.foreach_set(pixels.ravel())
        image.pack()
        yield image


def _material(bpy: Any, picture: Any, emits: bool) -> Any:
    """Create a diffuse material, face colour times texture, or an emissive one."""
    material = bpy.data.materials.new("surface")
    material.use_nodes = True
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    nodes.clear()

    def attribute(name: str) -> Any:
        node = nodes.new("ShaderNodeAttribute")
        node.attribute_name = name
        return node.outputs["Color"]

    def times(first: Any, second: Any) -> Any:
        node = nodes.new("ShaderNodeVectorMath")
        node.operation = "MULTIPLY"
        link(first, node.inputs[0])
        link(second, node.inputs[1])
        return node.outputs["Vector"]

    texel = None
    if picture is not None:
        node = nodes.new("ShaderNodeTexImage")
        node.image = picture
        texel = node.outputs["Color"]
    output = nodes.new("ShaderNodeOutputMaterial")
    if not emits:
        colour = attribute("colour")
        surface = nodes.new("ShaderNodeBsdfDiffuse")
        link(colour if texel is None else times(colour, texel), surface.inputs["Color"])
        link(surface.outputs["BSDF"], output.inputs["Surface"])
        return material
    emission = attribute("emission")
    mix = nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    path = nodes.new("ShaderNodeLightPath")
    link(path.outputs["Is Camera Ray"], mix.inputs["Factor"])
    colours = [socket for socket in mix.inputs if socket.type == "RGBA"]
    link(attribute("radiance"), colours[0])
    link(emission if texel is None else times(emission, texel), colours[1])
    shader = nodes.new("ShaderNodeEmission")
    result = next(socket for socket in mix.outputs if socket.type == "RGBA")
    link(result, shader.inputs["Color"])
    link(shader.outputs["Emission"], output.inputs["Surface"])
    return material
