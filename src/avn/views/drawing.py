"""Basics of procedural textures: seeded random generators, noise, tilings, sRGB conversion."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float64]


def draw(*names: object) -> np.random.Generator:
    """Create a random generator that is seeded by names and equal on every machine."""
    text = "\x1f".join(str(name) for name in names)
    seed = int.from_bytes(hashlib.sha256(text.encode()).digest()[:16], "little")
    return np.random.Generator(np.random.PCG64(seed))


def to_linear(srgb: NDArray) -> NDArray[np.float64]:
    """Convert sRGB values to linear ones, both 0 to 1 (IEC 61966-2-1)."""
    value = np.asarray(srgb, dtype=np.float64)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: NDArray) -> NDArray[np.float64]:
    """Convert linear values, clipped to 0 to 1, to sRGB ones (IEC 61966-2-1)."""
    value = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(value <= 0.0031308, value * 12.92, 1.055 * value ** (1 / 2.4) - 0.055)


def noise(
    rng: np.random.Generator, shape: tuple[int, int], slope: float, stretch: float = 1.0
) -> Image:
    """Draw tileable noise of mean 0 and standard deviation 1.

    Parameters
    ----------
    rng : np.random.Generator
    shape : (int, int)
        Rows and columns.
    slope : float
        Exponent with which the amplitude falls with frequency; 0 is white noise.
    stretch : float
        Anisotropy: factor on the horizontal frequency.
    """
    fy = np.fft.fftfreq(shape[0])[:, None] * shape[0]
    fx = np.fft.rfftfreq(shape[1])[None, :] * shape[1] * stretch
    radius = np.hypot(fy, fx)
    radius[0, 0] = 1.0
    spectrum = np.fft.rfft2(rng.random(shape) - 0.5) / radius**slope
    spectrum[0, 0] = 0.0
    found = np.fft.irfft2(spectrum, shape)
    return found / found.std()


def bond(
    pixels: int, rows: int, columns: int, shift: NDArray[np.float64]
) -> tuple[NDArray[np.int64], Image]:
    """Lay rectangular stones in courses, as in a brick bond.

    Parameters
    ----------
    pixels : int
        Image side in pixels.
    rows, columns : int
        Number of courses, and of stones in each.
    shift : (rows,) float64
        Horizontal shift of each course in stones.

    Returns
    -------
    (pixels, pixels) int64
        Index of the stone at each pixel.
    (pixels, pixels) float64
        Distance to the nearest joint as a fraction of the image side.
    """
    at = (np.arange(pixels) + 0.5) / pixels
    v = at[:, None] * rows
    row = v.astype(np.int64)
    u = at[None, :] * columns + shift[row]
    column = np.floor(u).astype(np.int64)
    fu, fv = u - column, np.broadcast_to(v - row, u.shape)
    edge = np.minimum(
        np.minimum(fu, 1 - fu) / columns,
        np.minimum(fv, 1 - fv) / rows,
    )
    return row * columns + column % columns, edge


def herringbone(pixels: int, length: int, repeats: int) -> tuple[NDArray[np.int64], Image]:
    """Lay staves in a herringbone pattern.

    Parameters
    ----------
    pixels : int
        Image side in pixels.
    length : int
        Ratio of length to width of a stave.
    repeats : int
        Repeats of the pattern along the image side.

    Returns
    -------
    (pixels, pixels) int64
        Index of the stave at each pixel.
    (pixels, pixels) float64
        Distance to the nearest joint as a fraction of the image side.
    """
    cells = 2 * length * repeats
    at = (np.arange(pixels) + 0.5) / pixels * cells
    x, y = np.meshgrid(at, at)
    i, j = x.astype(np.int64), y.astype(np.int64)
    k = (i - j) % (2 * length)
    lying = k < length
    i0, j0 = np.where(lying, i - k, i), np.where(lying, j, j - (2 * length - 1 - k))
    wide, high = np.where(lying, length, 1), np.where(lying, 1, length)
    edge = np.minimum(np.minimum(x - i0, i0 + wide - x), np.minimum(y - j0, j0 + high - y))
    return (i0 % cells) * cells + j0 % cells, edge / cells
