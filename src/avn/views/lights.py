"""Lamps and windows as light sources; intensities are relative, since images are exposed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import WALL_THICKNESS, FloorPlan, Window
from avn.views.appearance_palettes import LIGHT
from avn.views.drawing import draw

LAMP_RADIUS = 0.13
# Intensity of a lamp per square metre of its room.
_LAMP_STRENGTH = 0.35
# Radiance of a window pane under a sky of colour 1.
PANE_RADIANCE = 3.0


@dataclass(frozen=True)
class Light:
    """Colours of an apartment's lamps and sky.

    Attributes
    ----------
    lamp, sky : (3,) float64
        Linear RGB, relative to a usual brightness of 1.
    """

    lamp: NDArray[np.float64]
    sky: NDArray[np.float64]


@dataclass(frozen=True)
class Lamps:
    """L spherical light sources.

    Attributes
    ----------
    centre : (L, 3) float64
        Metres.
    radius : float
        Metres.
    intensity : (L, 3) float64
        Linear RGB radiant intensity; a surface that faces the lamp at distance d has the
        irradiance intensity / d^2.
    """

    centre: NDArray[np.float64]
    radius: float
    intensity: NDArray[np.float64]


@dataclass(frozen=True)
class Panes:
    """P rectangular light sources.

    Attributes
    ----------
    corner, side_a, side_b : (P, 3) float64
        A corner and the two edges from it, metres.
    normal : (P, 3) float64
        Unit vector into the room.
    radiance : (P, 3) float64
        Linear RGB, equal in all directions.
    """

    corner: NDArray[np.float64]
    side_a: NDArray[np.float64]
    side_b: NDArray[np.float64]
    normal: NDArray[np.float64]
    radiance: NDArray[np.float64]


def light_of(plan: FloorPlan, part: str, appearance_seed: int) -> Light:
    """Draw an apartment's light from an appearance palette.

    Parameters
    ----------
    plan : FloorPlan
    part : {"train", "validation", "test"}
        Split part, which selects the appearance palette.
    appearance_seed : int
        Seed of the random choice within the palette.
    """
    palette = LIGHT[part]
    rng = draw("light", part, plan.name, appearance_seed)
    lamp, sky = palette[int(rng.random() * len(palette))]
    return Light(np.array(lamp), np.array(sky))


def lamps_and_panes(plan: FloorPlan, light: Light) -> tuple[Lamps, Panes]:
    """Compute the light sources of a plan; a lamp's intensity is proportional to its room's area.

    Parameters
    ----------
    plan : FloorPlan
    light : Light
    """
    areas = []
    for lamp in plan.lamps:
        inside = [r for r in plan.rooms if r.x0 <= lamp.x <= r.x1 and r.y0 <= lamp.y <= r.y1]
        areas.append((inside[0].x1 - inside[0].x0) * (inside[0].y1 - inside[0].y0))
    strength = _LAMP_STRENGTH * np.array(areas, dtype=np.float64).reshape(-1, 1)
    lamps = Lamps(
        centre=np.array([(p.x, p.y, p.z) for p in plan.lamps], dtype=np.float64).reshape(-1, 3),
        radius=LAMP_RADIUS,
        intensity=strength * light.lamp,
    )
    panes = [_pane(window, plan) for window in plan.windows]
    geometry = np.array(panes, dtype=np.float64).reshape(-1, 4, 3)
    corner, side_a, side_b, normal = geometry.transpose(1, 0, 2)
    return lamps, Panes(
        corner, side_a, side_b, normal, np.tile(PANE_RADIANCE * light.sky, (len(panes), 1))
    )


def inward(window: Window, plan: FloorPlan) -> NDArray[np.float64]:
    """Compute the unit vector from a window into its room."""
    axis = 1 if window.along == "x" else 0
    step = np.zeros(3)
    step[axis] = 1.0
    x, y = np.array((window.x, window.y)) + 0.1 * step[:2]
    inside = any(r.x0 < x < r.x1 and r.y0 < y < r.y1 for r in plan.rooms)
    return step if inside else -step


def _pane(window: Window, plan: FloorPlan) -> tuple[NDArray[np.float64], ...]:
    normal = inward(window, plan)
    along = np.array((1.0, 0.0, 0.0) if window.along == "x" else (0.0, 1.0, 0.0))
    centre = np.array((window.x, window.y, window.sill)) + normal * WALL_THICKNESS / 2
    up = np.array((0.0, 0.0, window.height))
    return centre - along * window.width / 2, along * window.width, up, normal
