"""Compiled shading of ray hits: texture lookup, diffuse reflection, tone mapping."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from avn.views.drawing import to_linear, to_srgb

LINEAR = to_linear(np.arange(256) / 255).astype(np.float32)


@dataclass(frozen=True)
class Pyramids:
    """Image pyramids (mipmaps) of M textures with L levels.

    Williams, "Pyramidal parametrics", SIGGRAPH 1983.

    Attributes
    ----------
    texels : (N, 3) uint8
        sRGB texels of all textures and levels, concatenated.
    start : (M, L) int64
        First texel of texture m at level l. A texture with fewer levels repeats its last one.
    height, width : (M, L) int64
        Size in texels.
    """

    texels: NDArray[np.uint8]
    start: NDArray[np.int64]
    height: NDArray[np.int64]
    width: NDArray[np.int64]


def pyramids(pictures: tuple[NDArray[np.uint8], ...]) -> Pyramids:
    """Build the pyramids of sRGB images by averaging in linear light down to one pixel."""
    levels: list[list[NDArray[np.uint8]]] = []
    for picture in pictures:
        own = [np.ascontiguousarray(picture)]
        while max(own[-1].shape[:2]) > 1:
            own.append(_half(own[-1]))
        levels.append(own)
    depth = max((len(own) for own in levels), default=1)
    start = np.zeros((len(levels), depth), dtype=np.int64)
    height, width = np.ones_like(start), np.ones_like(start)
    flat, at = [np.zeros((0, 3), dtype=np.uint8)], 0
    for m, own in enumerate(levels):
        for level in range(depth):
            if level < len(own):
                start[m, level] = at
                flat.append(own[level].reshape(-1, 3))
                at += len(flat[-1])
            else:
                start[m, level] = start[m, level - 1]
            height[m, level], width[m, level] = own[min(level, len(own) - 1)].shape[:2]
    return Pyramids(np.concatenate(flat), start, height, width)


def _half(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    light = LINEAR[picture]
    for axis in (0, 1):
        n = light.shape[axis]
        if n > 1:
            first = np.arange(n // 2) * n // (n // 2)
            light = (light.take(first, axis) + light.take(first + 1, axis)) / 2
    return (to_srgb(light) * 255 + 0.5).astype(np.uint8)


@numba.njit(cache=True)
def _texel(
    out: NDArray[np.float32],
    u: float,
    v: float,
    level: int,
    m: int,
    texels: NDArray[np.uint8],
    start: NDArray[np.int64],
    height: NDArray[np.int64],
    width: NDArray[np.int64],
    linear: NDArray[np.float32],
) -> None:
    """Interpolate texture m bilinearly at (u, v) in linear light."""
    h, w, first = height[m, level], width[m, level], start[m, level]
    x, y = u * w - 0.5, (1.0 - v) * h - 0.5
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = x - x0, y - y0
    i0, j0 = int(x0) % w, int(y0) % h
    i1, j1 = (i0 + 1) % w, (j0 + 1) % h
    a, b = first + j0 * w + i0, first + j0 * w + i1
    c, d = first + j1 * w + i0, first + j1 * w + i1
    for k in range(3):
        top = linear[texels[a, k]] * (1 - fx) + linear[texels[b, k]] * fx
        low = linear[texels[c, k]] * (1 - fx) + linear[texels[d, k]] * fx
        out[k] = top * (1 - fy) + low * fy


@numba.njit(cache=True)
def sample(
    uv: NDArray[np.float32],
    texture: NDArray[np.int32],
    colour: NDArray[np.float32],
    level: int,
    texels: NDArray[np.uint8],
    start: NDArray[np.int64],
    height: NDArray[np.int64],
    width: NDArray[np.int64],
    linear: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Sample the albedo of N triangles at one pyramid level.

    Parameters
    ----------
    uv : (N, 2) float32
        Texture coordinates.
    texture : (N,) int32
        Index of the texture; -1 for plain colour.
    colour : (N, 3) float32
        Linear RGB albedo, which multiplies the texture.
    level : int
        Pyramid level; 0 is full resolution.
    texels : (K, 3) uint8
    start, height, width : (M, L) int64
        See `Pyramids`.
    linear : (256,) float32
        Linear value of each sRGB byte.

    Returns
    -------
    (N, 3) float32
        Linear RGB albedo.
    """
    out = colour.copy()
    texel = np.empty(3, dtype=np.float32)
    for n in range(len(uv)):
        if texture[n] >= 0:
            own = min(level, start.shape[1] - 1)
            _texel(texel, uv[n, 0], uv[n, 1], own, texture[n], texels, start, height, width, linear)
            for k in range(3):
                out[n, k] *= texel[k]
    return out


@numba.njit(cache=True)
def shade(
    triangle: NDArray[np.int32],
    hit_u: NDArray[np.float32],
    hit_v: NDArray[np.float32],
    distance: NDArray[np.float32],
    rays: NDArray[np.float32],
    samples: int,
    pixel: float,
    normal: NDArray[np.float32],
    density: NDArray[np.float32],
    uv: NDArray[np.float32],
    texture: NDArray[np.int32],
    colour: NDArray[np.float32],
    emission: NDArray[np.float32],
    corner: NDArray[np.int32],
    light: NDArray[np.float32],
    texels: NDArray[np.uint8],
    start: NDArray[np.int64],
    height: NDArray[np.int64],
    width: NDArray[np.int64],
    linear: NDArray[np.float32],
    exposure: float,
) -> NDArray[np.float32]:
    """Shade the ray hits of an image and average them over each pixel.

    Surfaces are diffuse: reflected radiance is albedo times irradiance over pi. Samples are tone
    mapped before they are averaged, which smooths edges of bright surfaces.

    Parameters
    ----------
    triangle : (N,) int32
        Triangle hit by each ray, pixel by pixel; -1 for no hit.
    hit_u, hit_v : (N,) float32
        Barycentric weights of the triangle's second and third vertex.
    distance : (N,) float32
        Metres.
    rays : (N, 3) float32
        Unit directions.
    samples : int
        Rays per pixel.
    pixel : float
        Width of a sample's part of the image plane at unit distance.
    normal : (T, 3) float32
        Unit normals.
    density : (T,) float32
        Texels per metre.
    uv : (T, 3, 2) float32
        Texture coordinates of the vertices.
    texture : (T,) int32
        Index of the texture; -1 for plain colour.
    colour : (T, 3) float32
        Linear RGB albedo, which multiplies the texture.
    emission : (T, 3) float32
        Linear RGB as exposed, multiplied by the texture.
    corner : (T, 3) int32
        Indices into `light`.
    light : (2, V, 3) float32
        Irradiance on front and back of each vertex, linear RGB.
    texels : (K, 3) uint8
    start, height, width : (M, L) int64
        See `Pyramids`.
    linear : (256,) float32
        Linear value of each sRGB byte.
    exposure : float
        Factor on reflected radiance.

    Returns
    -------
    (N / samples, 3) float32
        Linear RGB after tone mapping, 0 to 1; 0 where no ray hits.
    """
    pixels = len(triangle) // samples
    out = np.zeros((pixels, 3), dtype=np.float32)
    texel = np.empty(3, dtype=np.float32)
    levels = start.shape[1]
    for p in range(pixels):
        met = 0
        for n in range(p * samples, (p + 1) * samples):
            t = triangle[n]
            if t < 0:
                continue
            met += 1
            b, c = hit_u[n], hit_v[n]
            a = 1.0 - b - c
            facing = 0.0
            for k in range(3):
                facing += rays[n, k] * normal[t, k]
            side = 1 if facing > 0 else 0
            texel[:] = 1.0
            m = texture[t]
            if m >= 0:
                u = a * uv[t, 0, 0] + b * uv[t, 1, 0] + c * uv[t, 2, 0]
                v = a * uv[t, 0, 1] + b * uv[t, 1, 1] + c * uv[t, 2, 1]
                # texels along the side of a sample's footprint, larger at grazing angles
                covered = density[t] * pixel * distance[n] / np.sqrt(max(abs(facing), 0.15))
                level = min(max(int(np.rint(np.log2(max(covered, 1e-3)))), 0), levels - 1)
                _texel(texel, u, v, level, m, texels, start, height, width, linear)
            i, j, k3 = corner[t, 0], corner[t, 1], corner[t, 2]
            for k in range(3):
                irradiance = a * light[side, i, k] + b * light[side, j, k] + c * light[side, k3, k]
                passed_on = colour[t, k] * irradiance / np.pi
                out[p, k] += tone_map(texel[k] * (passed_on * exposure + emission[t, k]))
        if met:
            for k in range(3):
                out[p, k] /= met
    return out


@numba.njit(cache=True)
def tone_map(x: float) -> float:
    """Apply the tone curve to an exposed linear value.

    Reinhard et al., "Photographic tone reproduction for digital images", SIGGRAPH 2002, equation
    4 with white at 4, after a power of 1.2 that raises the contrast.
    """
    x = max(x, 0.0) ** 1.2
    return min(x * (1.0 + x / 16.0) / (1.0 + x), 1.0)


_STEPS = (to_srgb(np.arange(4097) / 4096) * 255 + 0.5).astype(np.uint8)


@numba.njit(cache=True)
def _encode(light: NDArray[np.float32], steps: NDArray[np.uint8]) -> NDArray[np.uint8]:
    flat = light.ravel()
    out = np.empty(len(flat), dtype=np.uint8)
    for n in range(len(flat)):
        out[n] = steps[int(flat[n] * 4096 + 0.5)]
    return out


def encode(light: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Convert linear values from 0 to 1 to sRGB bytes, flattened."""
    found: NDArray[np.uint8] = _encode(light, _STEPS)
    return found


@numba.njit(cache=True)
def tone_map_pixels(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Apply `tone_map` to every value of an exposed image, flattened."""
    flat = light.ravel()
    out = np.empty(len(flat), dtype=np.float32)
    for n in range(len(flat)):
        out[n] = tone_map(flat[n])
    return out
