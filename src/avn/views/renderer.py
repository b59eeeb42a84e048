"""Interface of renderers: prepare an apartment's light once, then render views of its states."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import CEILING, FloorPlan
from avn.core.classes import import_class
from avn.core.errors import UserError
from avn.views.settings import LightConfig, RendererConfig

Prepared = dict[str, NDArray]


class Renderer(ABC):
    """Base class of renderers of the views of one apartment.

    Parameters
    ----------
    cfg : RendererConfig
    plan : FloorPlan
    part : {"train", "validation", "test"}
        Split part, which selects furniture models and appearance palette.
    appearance_seed : int
        Seed of the random choices among them.
    prepared : dict of arrays, optional
        Result of an earlier `prepare`, which is then not repeated.
    """

    @abstractmethod
    def __init__(
        self,
        cfg: RendererConfig,
        plan: FloorPlan,
        part: str,
        appearance_seed: int = 0,
        prepared: Prepared | None = None,
    ) -> None: ...

    @classmethod
    def check(cls, cfg: RendererConfig) -> None:
        """Validate the settings and the installation; raise `UserError` if either is unusable.

        A subclass with settings of its own extends this method.
        """
        check_range("camera.size", cfg.camera.size, 1, 4096)
        check_range("camera.height", cfg.camera.height, 0.05, CEILING - 0.05)
        check_range("camera.pitch", cfg.camera.pitch, -89, 89)
        check_range("camera.fov", cfg.camera.fov, 1, 170)

    @abstractmethod
    def prepare(self) -> Prepared:
        """Compute the data that all views of the apartment share, such as its baked light."""

    @abstractmethod
    def views(
        self, centres: NDArray[np.float64], headings: NDArray[np.int64]
    ) -> tuple[NDArray[np.uint8], NDArray[np.float16]]:
        """Render RGB and depth images.

        Parameters
        ----------
        centres : (N, 2) float64
            Camera positions (x, y) in metres.
        headings : (N,) int64
            0 north, 1 east, 2 south, 3 west.

        Returns
        -------
        (N, size, size, 3) uint8
            sRGB, row 0 at the top.
        (N, size, size) float16
            Depth at the pixel centre in metres along the optical axis; 0 for no hit.
        """


def check_range(key: str, value: float, low: float, high: float) -> None:
    """Raise `UserError` if a setting of the renderer is out of bounds.

    Parameters
    ----------
    key : str
        Config key below `renderer`.
    value : float
    low, high : float
        Inclusive bounds.
    """
    if not low <= value <= high:
        raise UserError(f"renderer.{key}: {value}; give {low:g} to {high:g}")


def check_light(cfg: LightConfig) -> None:
    """Raise `UserError` if a setting of the baked light is out of bounds."""
    check_range("light.spacing", cfg.spacing, 0.02, 1.0)
    check_range("light.shadow_rays", cfg.shadow_rays, 1, 4096)
    check_range("light.gather_rays", cfg.gather_rays, 1, 4096)
    check_range("light.bounces", cfg.bounces, 0, 100)
    check_range("light.smoothing", cfg.smoothing, 0, 100)


def renderer_class(cfg: RendererConfig) -> type[Renderer]:
    """Import the class that `_target_` names; raise `UserError` if there is none."""
    found: type[Renderer] = import_class("renderer._target_", cfg._target_)
    return found
