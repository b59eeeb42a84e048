"""Splitting and Russian roulette of rays, which keep their density and energies even.

Without it rays fill an apartment evenly while their energies drift apart by orders of magnitude; a
few rays of high energy then dominate late reflections and far rooms. So rays are followed for
some metres at a time. Then, in each cell of the plan, rays of much more energy than the others
there are split, and rays of much less energy end at random, their energy going to the survivors
(splitting and roulette, as in neutron transport: H. Kahn, Proc. Symposium on Monte Carlo Methods,
1954). The expected energy is unchanged everywhere.

A ray stands for a cone. Its copies take different directions within the cone; else copies that are
only reflected specularly would stay together, with the energy of the ray that was split.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from avn.acoustics.kernels import uniform

CELL = 1.0  # metres: rays are compared with those in the same square cell of the plan
_BAND = 2.0  # largest ratio of a ray's energy to the wanted one, and of that to the ray's
_SPLIT = 4.0  # largest number of copies of a ray at one time
_DRAW = -2  # marks the random numbers of this module


class Rays(NamedTuple):
    """State of N rays.

    Attributes
    ----------
    position : (N, 3) float64
        Metres.
    direction : (N, 3) float64
        Unit vectors.
    carried : (N, 6) float64
        Energy in each octave band.
    bounces : (N,) int64
        Number of reflections so far.
    """

    position: NDArray[np.float64]
    direction: NDArray[np.float64]
    carried: NDArray[np.float64]
    bounces: NDArray[np.int64]


@njit(cache=True)
def _cells(rays: Rays, low, shape):  # type: ignore[no-untyped-def]
    """Return the index of the plan's cell that each ray is in."""
    count = rays.position.shape[0]
    cells = np.empty(count, np.int64)
    for ray in range(count):
        ix = min(max(int((rays.position[ray, 0] - low[0]) / CELL), 0), shape[0] - 1)
        iy = min(max(int((rays.position[ray, 1] - low[1]) / CELL), 0), shape[1] - 1)
        cells[ray] = ix * shape[1] + iy
    return cells


@njit(cache=True)
def _share_out(rays: Rays, low, shape, wanted: float, seed: int, step: int):  # type: ignore[no-untyped-def]
    """Draw the number of copies of each ray, and the factor on the energy of each copy.

    Copies within a cell are drawn by systematic sampling: their number is the expected one to
    within one.
    """
    count = rays.position.shape[0]
    cells = _cells(rays, low, shape)
    total, carry = np.zeros(shape[0] * shape[1]), np.zeros(shape[0] * shape[1])
    occupied = 0
    for ray in range(count):
        if total[cells[ray]] == 0.0:
            occupied += 1
        total[cells[ray]] += rays.carried[ray].sum()
    for cell in range(carry.shape[0]):
        carry[cell] = uniform(seed, cell, _DRAW, step)
    copies, factor = np.ones(count, np.int64), np.ones(count)
    for ray in range(count):
        cell = cells[ray]
        energy = total[cell] * occupied / wanted  # wanted energy of each ray in the cell
        ratio = rays.carried[ray].sum() / energy
        if 1.0 / _BAND <= ratio <= _BAND:
            continue
        ratio = min(ratio, _SPLIT)
        carry[cell] += ratio
        copies[ray] = int(carry[cell])
        carry[cell] -= copies[ray]
        factor[ray] = 1.0 / ratio
    return copies, factor


@njit(cache=True)
def _spread(direction, parent, radius: float, seed: int, step: int) -> None:  # type: ignore[no-untyped-def]
    """Turn all copies of a ray but the first by up to `radius` radians, uniformly over the cone."""
    for ray in range(1, direction.shape[0]):
        if parent[ray] != parent[ray - 1]:
            continue
        away = radius * math.sqrt(uniform(seed, ray, _DRAW - 1, 2 * step))
        angle = 2 * math.pi * uniform(seed, ray, _DRAW - 1, 2 * step + 1)
        old = direction[ray].copy()
        # A perpendicular unit vector: the least aligned axis, orthogonalised (Gram-Schmidt).
        least = np.argmin(np.abs(old))
        one = -old[least] * old
        one[least] += 1.0
        one /= math.sqrt((one * one).sum())
        two = np.cross(old, one)
        new = old + away * (math.cos(angle) * one + math.sin(angle) * two)
        direction[ray] = new / math.sqrt((new * new).sum())


def even_out(
    rays: Rays,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    wanted: int,
    seed: int,
    step: int,
) -> Rays:
    """Split rays of high energy and end rays of low energy, so that cells have equally many.

    Parameters
    ----------
    rays : Rays
        Rays at the end of a step.
    low, high : array, shape (2,)
        Bounds of the plan, metres.
    wanted : int
        Approximate number of rays to return.
    seed, step : int
        Seed of the random numbers, and number of the step.

    Returns
    -------
    Rays
        Rays with which the next step begins.
    """
    shape = np.maximum(np.ceil((high - low) / CELL), 1).astype(np.int64)
    copies, factor = _share_out(rays, low, shape, float(wanted), seed, step)
    parent = np.repeat(np.arange(len(copies)), copies)
    direction = rays.direction[parent]
    _spread(direction, parent, 2.0 / np.sqrt(wanted), seed, step)
    return Rays(
        rays.position[parent],
        direction,
        rays.carried[parent] * factor[parent, None],
        rays.bounces[parent],
    )
