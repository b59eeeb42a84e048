"""Ray tracing: what every listener receives of one source, reflection by reflection.

Rays leave the source on a Fibonacci lattice, carry energy in six octave bands and are reflected
like from a mirror or after Lambert's law, by the scattering of what they meet. Listeners are
spheres; a ray that crosses one adds energy x chord / volume, which is the energy that flows through
the place per unit of area (E / (4 pi D^2) for the direct sound). The direct sound itself is left
out: `avn.acoustics.direct_path` adds it exactly. `avn.acoustics.population` keeps about as many
rays in every place.

A ray has one direction for all bands. It is drawn by the mean scattering over the bands; at its
first reflections, which shape what is heard most, each band is weighted so that its own scattering
holds in the mean. Weighting all reflections would let the weights of a long path run away.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from avn.acoustics import materials
from avn.acoustics.kernels import Room, plan_bounds, uniform
from avn.acoustics.population import Rays, even_out
from avn.acoustics.rays import Limits, Record, follow
from avn.acoustics.receivers import Listeners, sort_listeners
from avn.apartments.surfaces import Surfaces

LATE_REACH = 1.5  # rays go on for so many times `seconds`, to measure what is cut off
LATE_EVERY = 4  # one ray for so many goes on there
WEIGHTED_REFLECTIONS = 2
ENERGY_FLOOR = 1e-8  # a ray that has lost 80 dB in its loudest band ends
STEP = 5.0  # metres for which rays are followed before their numbers are evened out
_EVENTS_AT_ONCE = 1 << 15


@dataclass(frozen=True)
class Events:
    """What L listeners receive, as N events sorted by listener.

    Attributes
    ----------
    starts : (L + 1,) int64
        Events `starts[l]` to `starts[l + 1]` belong to listener l.
    distance : (N,) float32
        Length of the way from the source, metres.
    energy : (N, 6) float32
        Energy per square metre in each octave band, of a source that sends out 1 in each.
    arrival : (N, 3) float32
        Unit vectors from the listener to where the sound comes from.
    sign : (N,) int8
        -1 or 1, drawn: the phase of an event is not known to rays.
    seconds : float
        Up to here all rays were followed; later events stem from few rays and serve to measure
        what is cut off.
    """

    starts: NDArray[np.int64]
    distance: NDArray[np.float32]
    energy: NDArray[np.float32]
    arrival: NDArray[np.float32]
    sign: NDArray[np.int8]
    seconds: float

    def listener(self) -> NDArray[np.int64]:
        """The listener of every event, shape (N,)."""
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))

    def histogram(self, width: float = 0.001) -> NDArray[np.float64]:
        """Energy over time, shape (L, bins, 6), in bins of `width` seconds up to `seconds`."""
        bins = round(self.seconds / width)
        people = len(self.starts) - 1
        place = (self.distance / (materials.SPEED_OF_SOUND * width)).astype(np.int64)
        kept = place < bins
        flat = (self.listener() * bins + place)[kept]
        columns = [
            np.bincount(flat, weights=self.energy[kept, band], minlength=people * bins)
            for band in range(self.energy.shape[1])
        ]
        return np.stack(columns, axis=-1).astype(np.float64).reshape(people, bins, -1)


def fibonacci_directions(count: int, turn: float = 0.0) -> NDArray[np.float64]:
    """Unit vectors spread evenly over the sphere, shape (count, 3).

    The golden-angle spiral (A. Gonzalez, Mathematical Geosciences 42, 2010), turned about the
    vertical by `turn` radians.
    """
    index = np.arange(count, dtype=np.float64)
    z = 1 - (2 * index + 1) / count
    angle = index * np.pi * (3 - np.sqrt(5)) + turn
    radius = np.sqrt(1 - z * z)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


def _sorted_room(
    surfaces: Surfaces,
    absorption: NDArray[np.float64] | None,
    scattering: NDArray[np.float64] | None,
) -> Room:
    if absorption is None:
        absorption = materials.absorption(surfaces.materials)
    if scattering is None:
        scattering = materials.scattering(surfaces.materials)
    order = np.lexsort((surfaces.offset, surfaces.axis))
    axis = surfaces.axis[order].astype(np.int64)
    material = surfaces.material[order]
    scattered = np.asarray(scattering, dtype=np.float64)[material]
    return Room(
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
    room: Room,
    attenuation: NDArray[np.float64],
    spheres: Listeners,
    limits: Limits,
    reach: float,
    seed: int,
) -> Record:
    """Follow rays step by step to `reach` metres, and a part of them on to what is cut off."""
    wanted = len(rays.position)
    low, high = plan_bounds(room)
    steps = max(1, round(reach / STEP))
    ends = np.linspace(0, reach, steps + 1)
    late = np.linspace(reach, LATE_REACH * reach, max(1, steps // 2) + 1)
    ways = np.concatenate([ends, late[1:]])
    parts: list[Record] = []
    size = _EVENTS_AT_ONCE
    for step, (begin, end) in enumerate(pairwise(ways)):
        while True:
            moved = Rays(*(array.copy() for array in rays))  # type: ignore[arg-type]
            part = _empty_record(size)
            going, count = follow(
                moved, begin, end, step, room, attenuation, spheres, limits, seed, part
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
    listeners: NDArray[np.float64],
    rays: int = 10000,
    depth: int = 250,
    seconds: float = 0.6,
    seed: int = 0,
    radius: float = 0.25,
    absorption: NDArray[np.float64] | None = None,
    scattering: NDArray[np.float64] | None = None,
    air: bool = True,
) -> Events:
    """Trace the reflections of one source for all listeners at once.

    Parameters
    ----------
    surfaces : Surfaces
        What the rays meet.
    source : array, shape (3,)
        Metres.
    listeners : array, shape (L, 3)
        Centres of the spheres that receive; anywhere, they may overlap.
    rays, depth : int
        Number of rays, and after how many reflections one ends at the latest.
    seconds : float
        How long rays are followed.
    seed : int
        Of all that is drawn; equal arguments give equal bytes.
    radius : float
        Of the spheres, metres.
    absorption, scattering : array, shape (len(surfaces.materials), 6), optional
        Coefficients in place of those that `avn.acoustics.materials` gives for the names.
    air : bool
        Whether air absorbs.

    Returns
    -------
    Events
        Without the direct sound.
    """
    room = _sorted_room(surfaces, absorption, scattering)
    centres = np.ascontiguousarray(listeners, dtype=np.float64).reshape(-1, 3)
    attenuation = materials.air_attenuation() if air else np.zeros(len(materials.BANDS))
    limits = Limits(depth, ENERGY_FLOOR / rays, WEIGHTED_REFLECTIONS)
    started = _start(np.asarray(source, dtype=np.float64), rays, seed)
    spheres = sort_listeners(centres, radius)
    who, distance, energy, arrival, sign = _follow_all(
        started, room, attenuation, spheres, limits, seconds * materials.SPEED_OF_SOUND, seed
    )
    sorting = np.argsort(who, kind="stable")
    counts = np.bincount(who, minlength=len(centres))
    return Events(
        starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        distance=distance[sorting],
        energy=energy[sorting],
        arrival=arrival[sorting],
        sign=sign[sorting],
        seconds=seconds,
    )
