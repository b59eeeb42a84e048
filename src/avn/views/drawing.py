"""What the drawing of patterns and light rests on: named random numbers, noise, tilings, sRGB."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float64]


def draw(*names: object) -> np.random.Generator:
    """Random numbers that are a function of names, the same on every machine."""
    text = "\x1f".join(str(name) for name in names)
    seed = int.from_bytes(hashlib.sha256(text.encode()).digest()[:16], "little")
    return np.random.Generator(np.random.PCG64(seed))


def to_linear(srgb: NDArray) -> NDArray[np.float64]:
    """Linear light, 0 to 1, of sRGB values 0 to 1 (IEC 61966-2-1)."""
    value = np.asarray(srgb, dtype=np.float64)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: NDArray) -> NDArray[np.float64]:
    """SRGB values 0 to 1 of linear light, clipped to 0 to 1 (IEC 61966-2-1)."""
    value = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(value <= 0.0031308, value * 12.92, 1.055 * value ** (1 / 2.4) - 0.055)


def noise(
    rng: np.random.Generator, shape: tuple[int, int], slope: float, stretch: float = 1.0
) -> Image:
    """Noise that repeats at the picture's edges, mean 0 and deviation 1.

    Parameters
    ----------
    rng : np.random.Generator
    shape : (int, int)
        Rows and columns.
    slope : float
        Amplitude falls with frequency to this power; 0 is white.
    stretch : float
        How much longer than high its grains are.
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
    """Courses of equal stones, each course pushed along by `shift` (rows,) of a stone.

    Returns
    -------
    (pixels, pixels) int64
        Number of the stone at each pixel.
    (pixels, pixels) float64
        How far the nearest joint is, in parts of the picture's side.
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
    """Staves `length` times as long as wide, laid at right angles; as `bond` returns."""
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
