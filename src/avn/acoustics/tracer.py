"""Energy ray tracing from one source to all receivers.

Rays leave the source on a Fibonacci lattice and carry energy in six octave bands. A surface
reflects them specularly or after Lambert's law, as its scattering coefficient says. Receivers are
spheres; a ray that crosses one adds energy x chord / volume, which is the energy that flows through
the sphere per unit of area (E / (4 pi D^2) for the direct sound). The direct sound itself is left
out: `avn.acoustics.direct_path` adds it exactly. `avn.acoustics.population` keeps the number of
rays about equal in all parts of the plan.

A ray has one direction for all bands. The mean scattering over the bands decides how it is
reflected. At the first reflections, which contribute most, each band is weighted so that its own
scattering holds in expectation. At later ones it is not: the weights of long paths would diverge.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from avn.acoustics import materials
from avn.acoustics.kernels import SortedSurfaces, plan_bounds, uniform
from avn.acoustics.population import Rays, even_out
from avn.acoustics.rays import Limits, Record, follow
from avn.acoustics.receivers import Receivers, sort_receivers
from avn.apartments.surfaces import Surfaces

LATE_REACH = 1.5  # rays are followed for this multiple of `seconds`, to measure the truncated part
LATE_EVERY = 4  # after `seconds`, one ray in so many is followed
WEIGHTED_REFLECTIONS = 2
ENERGY_FLOOR = 1e-8  # a ray that has lost 80 dB in its loudest band ends
STEP = 5.0  # metres between two runs of splitting and Russian roulette
_EVENTS_AT_ONCE = 1 << 15


@dataclass(frozen=True)
class Events:
    """Sound events at L receivers, N in all, sorted by receiver.

    Attributes
    ----------
    starts : (L + 1,) int64
        Events `starts[l]` to `starts[l + 1]` belong to receiver l.
    distance : (N,) float32
        Path length from the source, metres.
    energy : (N, 6) float32
        Energy per square metre in each octave band, of a source that emits 1 in each.
    arrival : (N, 3) float32
        Unit vectors from the receiver towards the direction of arrival.
    sign : (N,) int8
        -1 or 1, drawn at random: rays carry no phase.
    seconds : float
        All rays were followed up to this time. Later events stem from a part of the rays and
        serve to measure the truncated energy.
    """

    starts: NDArray[np.int64]
    distance: NDArray[np.float32]
    energy: NDArray[np.float32]
    arrival: NDArray[np.float32]
    sign: NDArray[np.int8]
    seconds: float

    def receiver(self) -> NDArray[np.int64]:
        """Return the receiver's index of every event, shape (N,)."""
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))

    def histogram(self, width: float = 0.001) -> NDArray[np.float64]:
        """Sum energy over time, shape (L, bins, 6), in bins of `width` seconds up to `seconds`."""
        bins = round(self.seconds / width)
        receiver_count = len(self.starts) - 1
        time_bin = (self.distance / (materials.SPEED_OF_SOUND * width)).astype(np.int64)
        kept = time_bin < bins
        flat = (self.receiver() * bins + time_bin)[kept]
        columns = [
            np.bincount(flat, weights=self.energy[kept, band], minlength=receiver_count * bins)
            for band in range(self.energy.shape[1])
        ]
        return np.stack(columns, axis=-1).astype(np.float64).reshape(receiver_count, bins, -1)


def fibonacci_directions(count: int, turn: float = 0.0) -> NDArray[np.float64]:
    """Return unit vectors spread evenly over the sphere, shape (count, 3).

    The golden-angle spiral (A. Gonzalez, Mathematical Geosciences 42, 2010), rotated about the
    vertical by `turn` radians.
    """
    index = np.arange(count, dtype=np.float64)
    z = 1 - (2 * index + 1) / count
    angle = index * np.pi * (3 - np.sqrt(5)) + turn
    radius = np.sqrt(1 - z * z)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


def _sort_surfaces(
    surfaces: Surfaces,
    absorption: NDArray[np.float64] | None,
    scattering: NDArray[np.float64] | None,
) -> SortedSurfaces:
    if absorption is None:
        absorption = materials.absorption(surfaces.materials)
    if scattering is None:
        scattering = materials.scattering(surfaces.materials)
    order = np.lexsort((surfaces.offset, surfaces.axis))
    axis = surfaces.axis[order].astype(np.int64)
    material = surfaces.material[order]
    scattered = np.asarray(scattering, dtype=np.float64)[material]
    return SortedSurfaces(
        starts=np.searchsorted(axis, np.arange(4)).astype(np.int64),
        axis=axis,
        offset=surfaces.offset[order],
        lower=surfaces.lower[order],
        upper=surfaces.upper[order],
        reflection=1 - np.asarray(absorption, dtype=np.float64)[material],
        scattering=scattered,
        mean_scattering=scattered.mean(axis=1),
    )


def _empty_record(size: int) -> Record:
    return Record(
        np.empty(size, np.int32),
        np.empty(size, np.float32),
        np.empty((size, len(materials.BANDS)), np.float32),
        np.empty((size, 3), np.float32),
        np.empty(size, np.int8),
    )


def _start(source: NDArray[np.float64], rays: int, seed: int) -> Rays:
    directions = fibonacci_directions(rays, 2 * np.pi * uniform(seed, 0, -1, 0))
    return Rays(
        np.tile(source, (rays, 1)),
        directions,
        np.full((rays, len(materials.BANDS)), 1.0 / rays),
        np.zeros(rays, np.int64),
    )


def _follow_all(
    rays: Rays,
    sorted_surfaces: SortedSurfaces,
    attenuation: NDArray[np.float64],
    spheres: Receivers,
    limits: Limits,
    reach: float,
    seed: int,
) -> Record:
    """Follow rays step by step to `reach` metres, and a part of them to `LATE_REACH` times it."""
    wanted = len(rays.position)
    low, high = plan_bounds(sorted_surfaces)
    steps = max(1, round(reach / STEP))
    ends = np.linspace(0, reach, steps + 1)
    late = np.linspace(reach, LATE_REACH * reach, max(1, steps // 2) + 1)
    bounds = np.concatenate([ends, late[1:]])
    parts: list[Record] = []
    size = _EVENTS_AT_ONCE
    for step, (begin, end) in enumerate(pairwise(bounds)):
        while True:
            moved = Rays(*(array.copy() for array in rays))  # type: ignore[arg-type]
            part = _empty_record(size)
            going, count = follow(
                moved, begin, end, step, sorted_surfaces, attenuation, spheres, limits, seed, part
            )
            if count >= 0:
                break
            size *= 2
        parts.append(Record(*(array[:count].copy() for array in part)))  # type: ignore[arg-type]
        if going == 0:
            break
        rays = Rays(*(array[:going] for array in moved))  # type: ignore[arg-type]
        now_wanted = wanted if end < reach else max(wanted // LATE_EVERY, 1)
        rays = even_out(rays, low, high, now_wanted, seed, step)
    return Record(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))  # type: ignore[arg-type]


def trace(
    surfaces: Surfaces,
    source: NDArray[np.float64],
    receivers: NDArray[np.float64],
    rays: int = 10000,
    depth: int = 250,
    seconds: float = 0.6,
    seed: int = 0,
    radius: float = 0.25,
    absorption: NDArray[np.float64] | None = None,
    scattering: NDArray[np.float64] | None = None,
    air: bool = True,
) -> Events:
    """Trace the reflections of one source to all receivers at once.

    Parameters
    ----------
    surfaces : Surfaces
        Reflecting rectangles.
    source : array, shape (3,)
        Position, metres.
    receivers : array, shape (L, 3)
        Centres of the receivers' spheres, metres; spheres may overlap.
    rays, depth : int
        Number of rays, and the largest number of reflections of one.
    seconds : float
        Length of the responses, seconds.
    seed : int
        Seed of all random draws; equal arguments give equal bytes.
    radius : float
        Radius of the spheres, metres.
    absorption, scattering : array, shape (len(surfaces.materials), 6), optional
        Coefficients in place of those of `avn.acoustics.materials`.
    air : bool
        True for absorption by air.

    Returns
    -------
    Events
        Reflections alone; the direct sound is not among them.
    """
    sorted_surfaces = _sort_surfaces(surfaces, absorption, scattering)
    centres = np.ascontiguousarray(receivers, dtype=np.float64).reshape(-1, 3)
    attenuation = materials.air_attenuation() if air else np.zeros(len(materials.BANDS))
    limits = Limits(depth, ENERGY_FLOOR / rays, WEIGHTED_REFLECTIONS)
    started = _start(np.asarray(source, dtype=np.float64), rays, seed)
    spheres = sort_receivers(centres, radius)
    receiver, distance, energy, arrival, sign = _follow_all(
        started,
        sorted_surfaces,
        attenuation,
        spheres,
        limits,
        seconds * materials.SPEED_OF_SOUND,
        seed,
    )
    sorting = np.argsort(receiver, kind="stable")
    counts = np.bincount(receiver, minlength=len(centres))
    return Events(
        starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        distance=distance[sorting],
        energy=energy[sorting],
        arrival=arrival[sorting],
        sign=sign[sorting],
        seconds=seconds,
    )
