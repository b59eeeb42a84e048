"""Procedural pictures on walls, which make rooms with similar surfaces distinguishable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from avn.apartments.floor_plan import DOOR_WIDTH, WALL_THICKNESS, Doorway, FloorPlan, Room, Window
from avn.apartments.surfaces import Rect
from avn.views.appearance_palettes import COLOURS
from avn.views.drawing import Image, draw, noise
from avn.views.textures import Pattern

DEPTH = 0.02
BORDER = 0.03
_PIXELS = 128
# Lowest and highest height of a picture, metres above the floor.
_LOW, _HIGH = 1.1, 1.95
# Furniture at most this many metres from a wall hides the pictures behind it.
_REACH = 0.35
# Height of the centre of a picture, metres above the floor.
_CENTRE = 1.5
# Probability of a picture on a free stretch of wall, by kind of room.
_PROBABILITY = {"bathroom": 0.3, "kitchen": 0.5, "bedroom": 0.8, "living_room": 0.9}


@dataclass(frozen=True)
class WallPicture:
    """A framed picture on a wall.

    Attributes
    ----------
    axis : int
        Axis of the wall's normal: 0 x, 1 y.
    offset : float
        Coordinate of the wall's face along `axis` in metres.
    normal : float
        Sign of the wall's normal.
    rect : Rect
        Bounds along the wall and in height in metres.
    picture : Pattern
        The painting.
    frame : (3,) float64
        sRGB colour of the frame, 0 to 1.
    """

    axis: int
    offset: float
    normal: float
    rect: Rect
    picture: Pattern
    frame: NDArray[np.float64]


def wall_pictures(plan: FloorPlan, part: str, appearance_seed: int) -> list[WallPicture]:
    """Draw the wall pictures of an apartment.

    No picture covers a doorway or window or hangs behind furniture.

    Parameters
    ----------
    plan : FloorPlan
    part : {"train", "validation", "test"}
        Split part, which selects the appearance palette.
    appearance_seed : int
        Seed of the random choices within the palette.
    """
    found = []
    for index, room in enumerate(plan.rooms):
        rng = draw("hangings", part, plan.name, index, appearance_seed)
        for axis, offset, normal, span in _faces(room):
            for low, high in _bare(plan, axis, offset, span):
                if high - low < 0.7 or rng.random() > _PROBABILITY[room.kind]:
                    continue
                count = 2 if high - low > 2.4 and rng.random() < 0.5 else 1
                for place in range(count):
                    width = min(rng.uniform(0.4, 1.0), (high - low) / count - 0.2)
                    height = rng.uniform(0.4, 0.7)
                    step = (high - low) / count
                    free = step - width - 0.2
                    left = low + place * step + 0.1 + free * rng.uniform(0.3, 0.7)
                    sill = _CENTRE - height / 2
                    rect = (left, sill, left + width, sill + height)
                    palette = COLOURS[part]["frame"]
                    frame = np.array(palette[int(rng.random() * len(palette))]) / 255
                    found.append(WallPicture(axis, offset, normal, rect, _paint(rng, part), frame))
    return found


def _faces(room: Room) -> list[tuple[int, float, float, tuple[float, float]]]:
    half = WALL_THICKNESS / 2
    x, y = (room.x0 + half, room.x1 - half), (room.y0 + half, room.y1 - half)
    return [(0, x[0], 1.0, y), (0, x[1], -1.0, y), (1, y[0], 1.0, x), (1, y[1], -1.0, x)]


def _bare(
    plan: FloorPlan, axis: int, offset: float, span: tuple[float, float]
) -> list[tuple[float, float]]:
    """Find the stretches of a wall's face without openings or furniture."""
    taken = []
    openings: list[Doorway | Window] = [*plan.doorways, *plan.windows]
    for opening in openings:
        if opening.along != ("y" if axis == 0 else "x"):
            continue
        across, centre = (opening.x, opening.y) if axis == 0 else (opening.y, opening.x)
        if abs(across - offset) < WALL_THICKNESS:
            half = getattr(opening, "width", DOOR_WIDTH) / 2 + 0.15
            taken.append((centre - half, centre + half))
    for piece in plan.furniture:
        bounds = piece.bounds
        near = min(abs(bounds[axis] - offset), abs(bounds[axis + 2] - offset))
        if near < _REACH and piece.z < _HIGH and piece.z + piece.height > _LOW:
            taken.append((bounds[1 - axis] - 0.1, bounds[3 - axis] + 0.1))
    bare, at = [], span[0] + 0.1
    for low, high in sorted(taken):
        if low > at:
            bare.append((at, min(low, span[1])))
        at = max(at, high)
    bare.append((at, span[1] - 0.1))
    return [(low, high) for low, high in bare if high > low]


def _paint(rng: np.random.Generator, part: str) -> Pattern:
    """Paint a picture in four colours: blocks, waves, blobs or stripes."""
    palette = COLOURS[part]["art"]
    colours = np.array(palette[int(rng.random() * len(palette))], dtype=np.float64) / 255
    colours = colours[np.argsort(rng.random(4))]
    at = (np.arange(_PIXELS) + 0.5) / _PIXELS
    x, y = np.meshgrid(at, at)
    kind = int(rng.random() * 4)
    if kind == 0:
        cuts = np.sort(rng.random((2, 3)), axis=1)
        column = (x[..., None] > cuts[0]).sum(axis=2)
        row = (y[..., None] > cuts[1]).sum(axis=2)
        field = (column * 3 + row * 5 + (column * row) % 3) % 4
    elif kind == 1:
        field = np.zeros(x.shape, dtype=np.int64)
        for layer in range(1, 4):
            waves = 0.06 * np.sin(2 * np.pi * (rng.uniform(0.5, 2) * at + rng.random()))
            field = np.where(y > 0.2 + 0.2 * layer + waves[None], layer, field)
    elif kind == 2:
        blots: Image = noise(rng, (_PIXELS, _PIXELS), 2.0)
        field = np.digitize(blots, np.quantile(blots, (0.35, 0.6, 0.85)))
    else:
        field = (np.cumsum(rng.random(_PIXELS) < 0.08) % 4)[None, :] * np.ones_like(x, dtype=int)
    image = gaussian_filter(colours[field], (0.7, 0.7, 0))
    image = image * (1 + 0.03 * noise(rng, (_PIXELS, _PIXELS), 0.6)[..., None])
    return Pattern((np.clip(image, 0, 1) * 255 + 0.5).astype(np.uint8), 1.0, 1.0)
