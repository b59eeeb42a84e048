"""Settings of the config groups `renderer` and `backbone`; importing them needs no torch."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class CameraConfig:
    """Pinhole camera with square images, at the centre of the agent's cell.

    Attributes
    ----------
    height : float
        Metres above the floor.
    pitch : float
        Pitch angle in degrees; negative points the camera down.
    fov : float
        Horizontal field of view in degrees.
    size : int
        Image side in pixels.
    """

    height: float = 1.5
    pitch: float = -30.0
    fov: float = 90.0
    size: int = 128


@dataclass
class LightConfig:
    """Resolution and sampling of the baked light.

    Attributes
    ----------
    spacing : float
        Metres between sample points.
    shadow_rays : int
        Shadow rays per sample point and light source.
    gather_rays : int
        Rays per sample point for indirect light.
    bounces : int
        Number of indirect bounces.
    smoothing : int
        Number of smoothing passes over the indirect light.
    """

    spacing: float = 0.07
    shadow_rays: int = 12
    gather_rays: int = 64
    bounces: int = 5
    smoothing: int = 2


@dataclass
class RendererConfig:
    """The config group `renderer`: settings of all renderers.

    Attributes
    ----------
    name : str
        Part of the name of the file of views.
    camera : CameraConfig
        The agent's camera.
    """

    _target_: str = ""
    name: str = ""
    camera: CameraConfig = field(default_factory=CameraConfig)


@dataclass
class RaycastConfig(RendererConfig):
    """Settings of `renderer=raycast`.

    Attributes
    ----------
    samples : int
        Rays along each side of a pixel.
    light : LightConfig
        Settings of the baked light.
    """

    _target_: str = "avn.views.raycast.Raycast"
    name: str = "raycast"
    samples: int = 2
    light: LightConfig = field(default_factory=LightConfig)


@dataclass
class CyclesConfig(RendererConfig):
    """Settings of `renderer=cycles`.

    Attributes
    ----------
    samples : int
        Light paths a pixel.
    bounces : int
        Maximum number of light bounces.
    denoise : bool
        Apply Open Image Denoise to each image.
    light : LightConfig
        Settings of the baked light, from which only the exposure is computed.
    """

    _target_: str = "avn.views.cycles.Cycles"
    name: str = "cycles"
    samples: int = 16
    bounces: int = 3
    denoise: bool = True
    light: LightConfig = field(
        default_factory=lambda: LightConfig(spacing=0.25, shadow_rays=4, gather_rays=16)
    )


@dataclass
class BackboneConfig:
    """The config group `backbone`.

    Attributes
    ----------
    name : str
        Part of the name of the file of features.
    size : int
        Side in pixels to which views are resized before they enter the network.
    source : str, optional
        ResNets only: name on the Hugging Face hub, or a folder with `config.json` and weights.
    """

    _target_: str = "avn.views.backbone.EfficientNetLite0"
    name: str = "efficientnet_lite0"
    size: int = 128
    source: str | None = None
