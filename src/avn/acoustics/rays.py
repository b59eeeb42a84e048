"""Propagation of rays over a given path length, compiled by Numba."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from avn.acoustics.kernels import SortedSurfaces, nearest_hit, reflect, uniform
from avn.acoustics.population import Rays
from avn.acoustics.receivers import Hits, Receivers, intersected_receivers

_TURNS = 1 << 16  # reflections between two steps draw from ranges that do not meet


class Limits(NamedTuple):
    """Limits on the reflections of a ray.

    Attributes
    ----------
    depth : int
        Largest number of reflections.
    floor : float
        A ray ends when the energy of its loudest band is below this.
    weighted : int
        Number of first reflections at which each band has its own scattering.
    """

    depth: int
    floor: float
    weighted: int


class Record(NamedTuple):
    """Buffers for events: receiver (N,), distance (N,), energy (N, 6), arrival (N, 3), sign (N,).

    Distances are in metres; the other fields are those of `avn.acoustics.tracer.Events`.
    """

    receiver: NDArray[np.int32]
    distance: NDArray[np.float32]
    energy: NDArray[np.float32]
    arrival: NDArray[np.float32]
    sign: NDArray[np.int8]


@njit(cache=True)
def _write(  # type: ignore[no-untyped-def]
    record, place, count, hits, travelled, carried, direction, air, radius, seed, ray, turn
) -> None:
    """Write the events of the `count` receivers in `hits` into `record` from entry `place` on."""
    volume = 4.0 / 3.0 * math.pi * radius**3
    for k in range(count):
        receiver, distance = hits.receivers[k], travelled + hits.midpoints[k]
        share = hits.chords[k] / volume
        for band in range(carried.shape[0]):
            loss = math.exp(-air[band] * distance)
            record.energy[place + k, band] = carried[band] * share * loss
        record.receiver[place + k] = receiver
        record.distance[place + k] = distance
        for i in range(3):
            record.arrival[place + k, i] = -direction[i]
        record.sign[place + k] = -1 if uniform(seed, ray, turn, 3 + receiver) < 0.5 else 1


@njit(cache=True)
def _lose(carried, surfaces, quad, specular, weighted) -> float:  # type: ignore[no-untyped-def]
    """Reduce a ray's energy at a reflection and return the energy of its loudest band.

    The direction is drawn by the mean scattering. Where `weighted`, each band is multiplied by
    the ratio of its own probability of that kind of reflection to the mean one.
    """
    chance = surfaces.mean_scattering[quad]
    loudest = 0.0
    for band in range(carried.shape[0]):
        carried[band] *= surfaces.reflection[quad, band]
        if weighted and 0.0 < chance < 1.0:
            share = surfaces.scattering[quad, band]
            carried[band] *= (1 - share) / (1 - chance) if specular else share / chance
        loudest = max(loudest, carried[band])
    return loudest


@njit(cache=True)
def follow(  # type: ignore[no-untyped-def]
    rays: Rays,
    begin: float,
    end: float,
    step: int,
    surfaces: SortedSurfaces,
    air,
    receivers: Receivers,
    limits: Limits,
    seed: int,
    record: Record,
) -> tuple[int, int]:
    """Propagate rays in place over a part of their path and record the receivers they cross.

    Rays that go on are moved to the front.

    Parameters
    ----------
    rays : Rays
        Rays at `begin`; changed in place.
    begin, end : float
        Path lengths from the source, metres.
    step : int
        Number of the step; the random numbers depend on it.
    surfaces : SortedSurfaces
        Reflecting rectangles.
    air : array, shape (6,)
        Attenuation of energy by air in each band, 1/metre.
    receivers : Receivers
        Spheres that record the rays.
    limits : Limits
        Ends of rays.
    seed : int
        Seed of all random draws.
    record : Record
        Buffers that take the events.

    Returns
    -------
    going : int
        Number of rays that go on.
    written : int
        Number of events; -1 where `record` is too short for them.
    """
    receiver_count = receivers.centres.shape[0]
    hits = Hits(
        np.full(receiver_count, -1, np.int64),
        np.empty(receiver_count, np.int64),
        np.empty(receiver_count),
        np.empty(receiver_count),
    )
    going, stamp, written = 0, 0, 0
    for ray in range(rays.position.shape[0]):
        position, direction = rays.position[ray].copy(), rays.direction[ray].copy()
        carried, bounces = rays.carried[ray].copy(), rays.bounces[ray]
        travelled, turn = begin, step * _TURNS
        while True:
            length, quad = nearest_hit(position, direction, surfaces)
            stops = length >= end - travelled
            length = min(length, end - travelled)
            if bounces > 0:  # `avn.acoustics.direct_path` adds the direct sound
                stamp += 1
                count = intersected_receivers(position, direction, length, receivers, hits, stamp)
                if written + count > record.receiver.shape[0]:
                    return 0, -1
                _write(
                    record,
                    written,
                    count,
                    hits,
                    travelled,
                    carried,
                    direction,
                    air,
                    receivers.radius,
                    seed,
                    ray,
                    turn,
                )
                written += count
            travelled += length
            for i in range(3):
                position[i] += length * direction[i]
            if stops:
                rays.position[going], rays.direction[going] = position, direction
                rays.carried[going], rays.bounces[going] = carried, bounces
                going += 1
                break
            bounces += 1
            axis = surfaces.axis[quad]
            position[axis] = surfaces.offset[quad]
            specular = uniform(seed, ray, turn, 0) >= surfaces.mean_scattering[quad]
            loudest = _lose(carried, surfaces, quad, specular, bounces <= limits.weighted)
            if loudest < limits.floor or bounces > limits.depth:
                break
            one, two = uniform(seed, ray, turn, 1), uniform(seed, ray, turn, 2)
            reflect(direction, axis, specular, one, two)
            turn += 1
    return going, written
