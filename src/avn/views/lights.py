"""Lamps and windows as sources of light; strengths are relative, for pictures are exposed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import WALL_THICKNESS, FloorPlan, Window
from avn.views.drawing import draw
from avn.views.pools import LIGHT

LAMP_RADIUS = 0.13
# Intensity of a lamp for each square metre of its room.
_LAMP_STRENGTH = 0.35
# Radiance of the usual sky.
PANE_RADIANCE = 3.0


@dataclass(frozen=True)
class Light:
    """How an apartment is lit: colours and strengths, 1 being usual.

    Attributes
    ----------
    lamp, sky : (3,) float64
        Linear RGB.
    """

    lamp: NDArray[np.float64]
    sky: NDArray[np.float64]


@dataclass(frozen=True)
class Lamps:
    """L glowing spheres.

    Attributes
    ----------
    centre : (L, 3) float64
        Metres.
    radius : float
        Metres.
    intensity : (L, 3) float64
        Linear RGB; a surface that faces the lamp at distance d receives intensity / d^2.
    """

    centre: NDArray[np.float64]
    radius: float
    intensity: NDArray[np.float64]


@dataclass(frozen=True)
class Panes:
    """P glowing rectangles.

    Attributes
    ----------
    corner, side_a, side_b : (P, 3) float64
        A corner and the two edges from it, metres.
    normal : (P, 3) float64
        Points into the room.
    radiance : (P, 3) float64
        Linear RGB, the same in all directions.
    """

    corner: NDArray[np.float64]
    side_a: NDArray[np.float64]
    side_b: NDArray[np.float64]
    normal: NDArray[np.float64]
    radiance: NDArray[np.float64]


def light_of(plan: FloorPlan, part: str, look: int) -> Light:
    """Draw an apartment's light from the pool of its part."""
    pool = LIGHT[part]
    rng = draw("light", part, plan.name, look)
    lamp, sky = pool[int(rng.random() * len(pool))]
    return Light(np.array(lamp), np.array(sky))


def lamps_and_panes(plan: FloorPlan, light: Light) -> tuple[Lamps, Panes]:
    """The sources of light of a plan: a lamp is as strong as its room is large."""
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
    """The unit vector from a window into its room."""
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
