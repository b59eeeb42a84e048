"""Following rays for a stretch of their way: compiled."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from avn.acoustics.kernels import Room, nearest_hit, reflect, uniform
from avn.acoustics.population import Rays
from avn.acoustics.receivers import Listeners, Met, passed_listeners

_TURNS = 1 << 16  # reflections between two steps draw from ranges that do not meet


class Limits(NamedTuple):
    """When rays end: after `depth` reflections, or when their loudest band is below `floor`.

    At the first `weighted` reflections each band has its own scattering.
    """

    depth: int
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
def _write(  # type: ignore[no-untyped-def]
    record, place, count, met, travelled, carried, direction, air, radius, seed, ray, turn
) -> None:
    """Record what the `count` listeners that a stretch of a ray passes receive."""
    volume = 4.0 / 3.0 * math.pi * radius**3
    for k in range(count):
        who, way = met.found[k], travelled + met.middles[k]
        share = met.chords[k] / volume
        for band in range(carried.shape[0]):
            record.energy[place + k, band] = carried[band] * share * math.exp(-air[band] * way)
        record.listener[place + k] = who
        record.distance[place + k] = way
        for i in range(3):
            record.arrival[place + k, i] = -direction[i]
        record.sign[place + k] = -1 if uniform(seed, ray, turn, 3 + who) < 0.5 else 1


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
def follow(  # type: ignore[no-untyped-def]
    rays: Rays,
    begin: float,
    end: float,
    step: int,
    room: Room,
    air,
    listeners: Listeners,
    limits: Limits,
    seed: int,
    record: Record,
) -> tuple[int, int]:
    """Move rays in place from `begin` to `end` metres of their way and record who hears them.

    Rays that go on are moved to the front. Returns their number and the count of events, -1 where
    `record` is too short for them.
    """
    people = listeners.centres.shape[0]
    met = Met(
        np.full(people, -1, np.int64),
        np.empty(people, np.int64),
        np.empty(people),
        np.empty(people),
    )
    going, stamp, written = 0, 0, 0
    for ray in range(rays.position.shape[0]):
        position, direction = rays.position[ray].copy(), rays.direction[ray].copy()
        carried, bounces = rays.carried[ray].copy(), rays.bounces[ray]
        travelled, turn = begin, step * _TURNS
        while True:
            length, quad = nearest_hit(position, direction, room)
            stops = length >= end - travelled
            length = min(length, end - travelled)
            if bounces > 0:  # the direct sound is not the tracer's business
                stamp += 1
                count = passed_listeners(position, direction, length, listeners, met, stamp)
                if written + count > record.listener.shape[0]:
                    return 0, -1
                _write(
                    record,
                    written,
                    count,
                    met,
                    travelled,
                    carried,
                    direction,
                    air,
                    listeners.radius,
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
            axis = room.axis[quad]
            position[axis] = room.offset[quad]
            specular = uniform(seed, ray, turn, 0) >= room.mean_scattering[quad]
            loudest = _lose(carried, room, quad, specular, bounces <= limits.weighted)
            if loudest < limits.floor or bounces > limits.depth:
                break
            one, two = uniform(seed, ray, turn, 1), uniform(seed, ray, turn, 2)
            reflect(direction, axis, specular, one, two)
            turn += 1
    return going, written
