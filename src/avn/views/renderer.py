"""What every renderer is: it lights an apartment once, and then makes views of its states."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CEILING, FloorPlan
from avn.core.classes import import_class
from avn.core.errors import UserError
from avn.views.camera import CameraConfig
from avn.views.lighting import LightConfig

Prepared = dict[str, NDArray]


@dataclass
class RendererConfig:
    """The config group `renderer`: what they all have.

    Attributes
    ----------
    name : str
        Names the file of the views.
    camera : CameraConfig
    """

    _target_: str = ""
    name: str = ""
    camera: CameraConfig = field(default_factory=CameraConfig)


class Renderer(ABC):
    """Makes the views of one apartment.

    Parameters
    ----------
    cfg : RendererConfig
    plan : FloorPlan
    part : {"train", "validation", "test"}
        The pool of models, patterns and light.
    look : int
        Which draw from the pool.
    prepared : dict of arrays, optional
        What `prepare` gave, to save doing it again.
    """

    @abstractmethod
    def __init__(
        self,
        cfg: RendererConfig,
        plan: FloorPlan,
        part: str,
        look: int = 0,
        prepared: Prepared | None = None,
    ) -> None: ...

    @classmethod
    def check(cls, cfg: RendererConfig) -> None:
        """Raise `UserError` for a value that makes no sense, or where something is not installed.

        A renderer with settings of its own looks at them too.
        """
        check_range("camera.size", cfg.camera.size, 1, 4096)
        check_range("camera.height", cfg.camera.height, 0.05, CEILING - 0.05)
        check_range("camera.pitch", cfg.camera.pitch, -89, 89)
        check_range("camera.fov", cfg.camera.fov, 1, 170)

    @abstractmethod
    def prepare(self) -> Prepared:
        """What is worked out once an apartment, such as its light."""

    @abstractmethod
    def views(
        self, centres: NDArray[np.float64], headings: NDArray[np.int64]
    ) -> tuple[NDArray[np.uint8], NDArray[np.float16]]:
        """Pictures from some places.

        Parameters
        ----------
        centres : (N, 2) float64
            Where the camera stands, metres.
        headings : (N,) int64

        Returns
        -------
        (N, size, size, 3) uint8
            sRGB, row 0 at the top.
        (N, size, size) float16
            Metres along the camera's axis to what the middle of the pixel shows; 0 for nothing.
        """


def check_range(key: str, value: float, low: float, high: float) -> None:
    """Raise `UserError` where a setting of the renderer is out of bounds."""
    if not low <= value <= high:
        raise UserError(f"renderer.{key}: {value}; give {low:g} to {high:g}")


def check_light(cfg: LightConfig) -> None:
    """Raise `UserError` where light cannot be baked so."""
    check_range("light.spacing", cfg.spacing, 0.02, 1.0)
    check_range("light.shadow_rays", cfg.shadow_rays, 1, 4096)
    check_range("light.gather_rays", cfg.gather_rays, 1, 4096)
    check_range("light.bounces", cfg.bounces, 0, 100)
    check_range("light.smoothing", cfg.smoothing, 0, 100)


def renderer_class(cfg: RendererConfig) -> type[Renderer]:
    """The class that `_target_` names; raises `UserError` where there is none."""
    found: type[Renderer] = import_class("renderer._target_", cfg._target_)
    return found
