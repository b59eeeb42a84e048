"""How many rays go where: so many that every place hears about as many, none much louder.

Left to themselves, rays fill an apartment evenly while their energies drift apart by orders of
magnitude; a few loud ones then decide what is heard late or in a far room. So rays are followed for
some metres at a time. Then, place by place, those that are much louder than the others there split,
and those that are much quieter end by chance, their energy handed to the survivors (splitting and
roulette, as in neutron transport: H. Kahn, Proc. Symposium on Monte Carlo Methods, 1954). The
expected energy stays the same everywhere: it is still the rays alone that make the sound.

A ray stands for a cone, of which its copies take different lines; else copies that meet mirrors
alone would stay together and be as loud as the one they come from.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from avn.acoustics.kernels import uniform

PLACE = 1.0  # metres: rays are compared with those in the same square of the plan
_BAND = 2.0  # how much louder or quieter than wanted a ray may be
_SPLIT = 4.0  # into how many a ray splits at most at one time
_DRAW = -2  # marks the random numbers of this module


class Rays(NamedTuple):
    """Rays under way: position and direction (N, 3), energy (N, 6), reflections so far (N,)."""

    position: NDArray[np.float64]
    direction: NDArray[np.float64]
    carried: NDArray[np.float64]
    bounces: NDArray[np.int64]


@njit(cache=True)
def _places(rays: Rays, low, shape):  # type: ignore[no-untyped-def]
    """The square of the plan that each ray is in."""
    count = rays.position.shape[0]
    places = np.empty(count, np.int64)
    for ray in range(count):
        ix = min(max(int((rays.position[ray, 0] - low[0]) / PLACE), 0), shape[0] - 1)
        iy = min(max(int((rays.position[ray, 1] - low[1]) / PLACE), 0), shape[1] - 1)
        places[ray] = ix * shape[1] + iy
    return places


@njit(cache=True)
def _share_out(rays: Rays, low, shape, wanted: float, seed: int, step: int):  # type: ignore[no-untyped-def]
    """How many copies of each ray go on, and by what its energy is multiplied in each.

    Within a place copies are dealt by systematic sampling: their number is right to within one,
    not only in the mean.
    """
    count = rays.position.shape[0]
    places = _places(rays, low, shape)
    total, carry = np.zeros(shape[0] * shape[1]), np.zeros(shape[0] * shape[1])
    occupied = 0
    for ray in range(count):
        if total[places[ray]] == 0.0:
            occupied += 1
        total[places[ray]] += rays.carried[ray].sum()
    for place in range(carry.shape[0]):
        carry[place] = uniform(seed, place, _DRAW, step)
    copies, factor = np.ones(count, np.int64), np.ones(count)
    for ray in range(count):
        place = places[ray]
        energy = total[place] * occupied / wanted  # that each ray of the place should have
        ratio = rays.carried[ray].sum() / energy
        if 1.0 / _BAND <= ratio <= _BAND:
            continue
        ratio = min(ratio, _SPLIT)
        carry[place] += ratio
        copies[ray] = int(carry[place])
        carry[place] -= copies[ray]
        factor[ray] = 1.0 / ratio
    return copies, factor


@njit(cache=True)
def _spread(direction, parent, radius: float, seed: int, step: int) -> None:  # type: ignore[no-untyped-def]
    """Turn copies (not the first of a ray) by up to `radius` radians, evenly over that cone."""
    for ray in range(1, direction.shape[0]):
        if parent[ray] != parent[ray - 1]:
            continue
        away = radius * math.sqrt(uniform(seed, ray, _DRAW - 1, 2 * step))
        angle = 2 * math.pi * uniform(seed, ray, _DRAW - 1, 2 * step + 1)
        old = direction[ray].copy()
        # A unit vector at right angles: the axis on which the ray leans least, made upright.
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
    """Split loud rays and end quiet ones, so that places have about equally many.

    Parameters
    ----------
    rays : Rays
    low, high : array, shape (2,)
        Bounds of the plan, metres.
    wanted : int
        How many rays there are to be, about.
    seed, step : int
        Of the random numbers.
    """
    shape = np.maximum(np.ceil((high - low) / PLACE), 1).astype(np.int64)
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
