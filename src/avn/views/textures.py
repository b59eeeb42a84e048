"""Procedural textures of floors, walls, ceilings and of the view through windows.

Each part of a split has an appearance palette of its own. Colours and patterns of the three
palettes are disjoint, so evaluation apartments test the generalisation of trained networks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from avn.views.appearance_palettes import COLOURS, LAYOUTS
from avn.views.drawing import Image, bond, draw, herringbone, noise

# Side of a pattern in pixels: about 5 mm each on a floor.
PIXELS = 384


@dataclass(frozen=True)
class Pattern:
    """Repeating texture.

    Attributes
    ----------
    picture : (h, w, 3) uint8
        sRGB.
    width, height : float
        Size of one repeat in metres.
    """

    picture: NDArray[np.uint8]
    width: float
    height: float


def pattern(material: str, part: str, *names: object) -> Pattern:
    """Draw the texture of a building material.

    Parameters
    ----------
    material : str
        Name of a material in `avn.acoustics.materials`.
    part : {"train", "validation", "test"}
        Split part, which selects the appearance palette.
    *names : object
        Seed of the random choices: apartment, room, surface and appearance seed.
    """
    rng = draw("pattern", material, part, *names)
    paint = _PAINTERS.get(material, _plaster)
    kind = material if material in COLOURS[part] else _SIMILAR.get(material, "plaster")
    return paint(rng, part, kind)


def _choose(rng: np.random.Generator, options: tuple) -> tuple:
    return options[int(rng.random() * len(options))]


def _colour(rng: np.random.Generator, part: str, kind: str) -> NDArray[np.float64]:
    """Draw an sRGB colour of the palette, 0 to 1, with jitter of up to 4 / 255."""
    base = np.array(_choose(rng, COLOURS[part][kind]), dtype=np.float64)
    return np.clip(base + rng.uniform(-4, 4, 3), 0, 255) / 255


def _finish(image: Image, width: float, height: float) -> Pattern:
    return Pattern((np.clip(image, 0, 1) * 255 + 0.5).astype(np.uint8), width, height)


def _tones(rng: np.random.Generator, stones: NDArray[np.int64], spread: float) -> Image:
    """Draw the relative brightness of each stone."""
    tones = 1 + spread * rng.uniform(-1, 1, int(stones.max()) + 1)
    return tones[stones][..., None]


def _parquet(rng: np.random.Generator, part: str, kind: str) -> Pattern:
    base = _colour(rng, part, kind)
    layout, rows, columns, side = _choose(rng, LAYOUTS[part]["parquet"])
    grain = noise(rng, (PIXELS, PIXELS), 1.0, 14.0)
    if layout == "herringbone":
        staves, edge = herringbone(PIXELS, columns, rows)
        turned = grain.T
        lying = rng.random(int(staves.max()) + 1)[staves] < 0.5
        grain = np.where(lying, grain, turned)
    else:
        shift = rng.random(rows) if layout == "planks" else np.arange(rows) % 2 * 0.5
        staves, edge = bond(PIXELS, rows, columns, shift)
    away = rng.integers(0, PIXELS, (int(staves.max()) + 1, 2))[staves]
    y, x = np.indices(staves.shape)
    grain = grain[(y + away[..., 0]) % PIXELS, (x + away[..., 1]) % PIXELS]
    image = base * _tones(rng, staves, 0.16) * (1 + 0.055 * grain[..., None])
    joint = np.clip(edge * side / 0.004, 0.0, 1.0)[..., None]
    return _finish(image * (0.55 + 0.45 * joint), side, side)


def _carpet(rng: np.random.Generator, part: str, kind: str) -> Pattern:
    base = _colour(rng, part, kind)
    pile = 0.08 * noise(rng, (PIXELS, PIXELS), 0.2) + 0.05 * noise(rng, (PIXELS, PIXELS), 1.2)
    (layout,) = _choose(rng, LAYOUTS[part]["carpet"])
    at = np.arange(PIXELS) / PIXELS
    if layout == "stripes":
        pile = pile + 0.10 * np.sign(np.sin(2 * np.pi * 5 * at))[None, :]
    elif layout == "checks":
        wave = np.sign(np.sin(2 * np.pi * 4 * at))
        pile = pile + 0.07 * wave[:, None] * wave[None, :]
    elif layout == "loops":
        wave = np.sin(2 * np.pi * 24 * at)
        pile = pile + 0.10 * wave[:, None] * wave[None, :]
    elif layout == "flecks":
        pile = pile + 0.18 * (noise(rng, (PIXELS, PIXELS), 0.6) > 1.6)
    return _finish(base * (1 + pile[..., None]), 1.6, 1.6)


def _tiles(rng: np.random.Generator, part: str, kind: str) -> Pattern:
    base = _colour(rng, part, kind)
    layout, rows, columns, side = _choose(rng, LAYOUTS[part][kind])
    shift = np.arange(rows) % 2 * (0.5 if layout == "bond" else 0.0)
    stones, edge = bond(PIXELS, rows, columns, shift)
    image = base * _tones(rng, stones, 0.05)
    if layout == "checks":
        other = _colour(rng, part, f"{kind}_second")
        odd = (stones // columns + stones % columns) % 2 == 1
        image = np.where(odd[..., None], other * _tones(rng, stones, 0.05), image)
    if layout == "band":
        image = np.where((stones // columns == rows // 2)[..., None], image * 0.62, image)
    marble = noise(rng, (PIXELS, PIXELS), 1.6)
    image = image * (1 + 0.03 * marble[..., None])
    grout = np.clip(edge * side / 0.004 - 0.25, 0.0, 1.0)[..., None]
    joint = base.mean() * (0.62 if base.mean() > 0.5 else 1.5)
    return _finish(image * grout + joint * (1 - grout), side, side)


def _brick(rng: np.random.Generator, part: str, kind: str) -> Pattern:
    base = _colour(rng, part, kind)
    layout, rows, columns, side = _choose(rng, LAYOUTS[part][kind])
    shift = np.arange(rows) % 2 * 0.5 if layout == "bond" else np.arange(rows) % 3 / 3
    stones, edge = bond(PIXELS, rows, columns, shift)
    rough = noise(rng, (PIXELS, PIXELS), 0.8)
    image = base * _tones(rng, stones, 0.07) * (1 + 0.03 * rough[..., None])
    depth = gaussian_filter(np.clip(edge * side / 0.007, 0.0, 1.0), 1.0, mode="wrap")
    lit = np.roll(depth, 1, axis=0) - np.roll(depth, -1, axis=0)  # light from above
    return _finish(image * (0.72 + 0.28 * depth - 0.25 * lit)[..., None], side, side)


def _plaster(rng: np.random.Generator, part: str, kind: str) -> Pattern:
    base = _colour(rng, part, kind)
    (layout,) = _choose(rng, LAYOUTS[part]["plaster"])
    tone = 0.012 * noise(rng, (PIXELS, PIXELS), 1.3) + 0.01 * noise(rng, (PIXELS, PIXELS), 0.3)
    at = np.arange(PIXELS) / PIXELS
    if layout == "stripes":
        tone = tone + 0.05 * np.sign(np.sin(2 * np.pi * 8 * at))[None, :]
    elif layout == "fine_stripes":
        tone = tone + 0.05 * (np.sin(2 * np.pi * 20 * at) > 0.6)[None, :]
    elif layout == "diamonds":
        u, v = np.meshgrid(at * 8, at * 8)
        tone = tone + 0.06 * (np.abs(u % 1 - 0.5) + np.abs(v % 1 - 0.5) < 0.3)
    elif layout == "dots":
        u, v = np.meshgrid(at * 10, at * 10)
        v = v + 0.5 * (u.astype(int) % 2)
        tone = tone - 0.08 * (np.hypot(u % 1 - 0.5, v % 1 - 0.5) < 0.2)
    elif layout == "leaves":
        tone = tone + 0.05 * (noise(rng, (PIXELS, PIXELS), 1.5, 0.5) > 0.7)
    elif layout == "rough":
        tone = tone * 2.5
    return _finish(base * (1 + tone[..., None]), 1.6, 1.6)


def _ceiling(rng: np.random.Generator, part: str, kind: str) -> Pattern:
    base = _colour(rng, part, kind)
    tone = 0.012 * noise(rng, (PIXELS, PIXELS), 1.0)
    return _finish(base * (1 + tone[..., None]), 2.0, 2.0)


# Materials without colours and layouts of their own whose painter needs both.
_SIMILAR = {"ceramic": "wall_tiles"}
_PAINTERS: dict[str, Callable[[np.random.Generator, str, str], Pattern]] = {
    "parquet": _parquet,
    "wood": _parquet,
    "laminate": _parquet,
    "carpet": _carpet,
    "fabric": _carpet,
    "floor_tiles": _tiles,
    "wall_tiles": _tiles,
    "ceramic": _tiles,
    "painted_brick": _brick,
    "ceiling_plaster": _ceiling,
}


def outdoors(part: str, *names: object) -> Pattern:
    """Draw the view through a window: sky above blurred trees or houses.

    The texture covers a whole pane and does not repeat.

    Parameters
    ----------
    part : {"train", "validation", "test"}
        Split part, which selects the appearance palette.
    *names : object
        Seed of the random choices: apartment and appearance seed.
    """
    rng = draw("outdoors", part, *names)
    rows = np.linspace(0, 1, 128)[:, None, None]  # 0 at the top
    high, low = (np.array(c) / 255 for c in _choose(rng, COLOURS[part]["sky"]))
    image = high + (low - high) * np.clip(rows / 0.6, 0, 1) + np.zeros((128, 128, 1))
    clouds = gaussian_filter(noise(rng, (128, 128), 1.6, 0.4), 2, mode="wrap")
    image = image + 0.06 * np.clip(clouds, 0, 2)[..., None] * (1 - rows)
    ground = np.array(_choose(rng, COLOURS[part]["ground"])) / 255
    far = np.arange(128)
    line = 0.60 + 0.05 * np.interp(far, far[::8], rng.standard_normal(16))
    if rng.random() < 0.5:  # roofs: flat steps
        line = 0.58 + 0.10 * rng.standard_normal(8).repeat(16)
    below = rows[..., 0] > line[None]
    brightness = 1 + 0.25 * noise(rng, (128, 128), 1.0)
    image = np.where(below[..., None], ground * brightness[..., None], image)
    image = gaussian_filter(image, (1.6, 1.6, 0), mode="nearest")
    return _finish(image, 1.0, 1.0)
