"""The loop over rays: compiled."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from avn.acoustics.kernels import Room, nearest_hit, reflect, uniform
from avn.acoustics.receivers import Listeners, Met, passed_listeners


class Limits(NamedTuple):
    """When rays end.

    `depth`: reflections at most. `reach`: metres; one ray in `late_every` goes on to
    `late_reach` and stands for the others there. `floor`: share of its energy at which a ray
    ends. `weighted`: at so many reflections each band has its own scattering.
    """

    depth: int
    reach: float
    late_reach: float
    late_every: int
    floor: float
    weighted: int


class Record(NamedTuple):
    """Room for events: listener (N,), distance (N,), energy (N, 6), arrival (N, 3), sign (N,)."""

    listener: NDArray[np.int32]
    distance: NDArray[np.float32]
    energy: NDArray[np.float32]
    arrival: NDArray[np.float32]
    sign: NDArray[np.int8]


@njit(cache=True)
def _write(record, place, who, way, share, carried, direction, air, odd) -> None:  # type: ignore[no-untyped-def]
    for band in range(carried.shape[0]):
        record.energy[place, band] = carried[band] * share * math.exp(-air[band] * way)
    record.listener[place] = who
    record.distance[place] = way
    for i in range(3):
        record.arrival[place, i] = -direction[i]
    record.sign[place] = -1 if odd else 1


@njit(cache=True)
def _lose(carried, room, quad, specular, weighted) -> float:  # type: ignore[no-untyped-def]
    """Take from a ray what a surface swallows; returns the energy of its loudest band.

    The direction is drawn by the mean scattering. Where `weighted`, the share of each band that
    goes that way makes up for it.
    """
    chance = room.mean_scattering[quad]
    loudest = 0.0
    for band in range(carried.shape[0]):
        carried[band] *= room.reflection[quad, band]
        if weighted and 0.0 < chance < 1.0:
            share = room.scattering[quad, band]
            carried[band] *= (1 - share) / (1 - chance) if specular else share / chance
        loudest = max(loudest, carried[band])
    return loudest


@njit(cache=True)
def trace_rays(  # type: ignore[no-untyped-def]
    first: int,
    directions,
    source,
    room: Room,
    air,
    listeners: Listeners,
    limits: Limits,
    seed: int,
    record: Record,
) -> tuple[int, int]:
    """Follow rays from number `first` on and record what listeners receive.

    Returns the ray to go on with (their number when all are done) and the count of events. A ray
    whose events find no room in `record` is taken back whole.
    """
    rays, people = directions.shape[0], listeners.centres.shape[0]
    volume = 4.0 / 3.0 * math.pi * listeners.radius**3
    met = Met(
        np.full(people, -1, np.int64),
        np.empty(people, np.int64),
        np.empty(people),
        np.empty(people),
    )
    position, direction, carried = np.empty(3), np.empty(3), np.empty(air.shape[0])
    written, stamp = 0, 0
    for ray in range(first, rays):
        before = written
        limit = limits.late_reach if ray % limits.late_every == 0 else limits.reach
        position[:] = source
        direction[:] = directions[ray]
        carried[:] = 1.0 / rays
        travelled = 0.0
        for bounce in range(limits.depth + 1):
            length, quad = nearest_hit(position, direction, room)
            length = min(length, limit - travelled)
            if bounce > 0:  # the direct sound is not the tracer's business
                stamp += 1
                count = passed_listeners(position, direction, length, listeners, met, stamp)
                if written + count > record.listener.shape[0]:
                    return ray, before
                for k in range(count):
                    way = travelled + met.middles[k]
                    share = met.chords[k] / volume
                    if way >= limits.reach:
                        share *= limits.late_every
                    who = met.found[k]
                    odd = uniform(seed, ray, bounce, 3 + who) < 0.5
                    _write(record, written, who, way, share, carried, direction, air, odd)
                    written += 1
            travelled += length
            if quad < 0 or travelled >= limit:
                break
            axis = room.axis[quad]
            for i in range(3):
                position[i] += length * direction[i]
            position[axis] = room.offset[quad]
            specular = uniform(seed, ray, bounce, 0) >= room.mean_scattering[quad]
            if _lose(carried, room, quad, specular, bounce < limits.weighted) * rays < limits.floor:
                break
            one, two = uniform(seed, ray, bounce, 1), uniform(seed, ray, bounce, 2)
            reflect(direction, axis, specular, one, two)
    return rays, written
