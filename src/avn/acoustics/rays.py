"""The loop over rays: compiled."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from avn.acoustics.kernels import Room, nearest_hit, reflect, uniform
from avn.acoustics.population import Window, wanted_energy
from avn.acoustics.receivers import Listeners, Met, passed_listeners

_BAND = 3.0  # how much louder or quieter than wanted a ray may be
_SPLIT = 4  # into how many a ray splits at most at one reflection
_WAITING = 1024  # how many of its offspring may wait; beyond that it goes on unsplit
_FAR = 1_000_003  # branches of a ray draw from ranges of reflections that do not meet


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
def _write(  # type: ignore[no-untyped-def]
    record, place, count, met, travelled, carried, direction, air, radius, limits, seed, ray, turn
) -> None:
    """Record what the `count` listeners that a stretch of a ray passes receive."""
    volume = 4.0 / 3.0 * math.pi * radius**3
    for k in range(count):
        who, way = met.found[k], travelled + met.middles[k]
        share = met.chords[k] / volume
        if way >= limits.reach:
            share *= limits.late_every
        for band in range(carried.shape[0]):
            record.energy[place + k, band] = carried[band] * share * math.exp(-air[band] * way)
        record.listener[place + k] = who
        record.distance[place + k] = way
        for i in range(3):
            record.arrival[place + k, i] = -direction[i]
        record.sign[place + k] = -1 if uniform(seed, ray, turn, 4 + who) < 0.5 else 1


@njit(cache=True)
def _swallow(carried, reflection) -> float:  # type: ignore[no-untyped-def]
    """Take from a ray what a surface swallows; returns its mean energy over the bands."""
    total = 0.0
    for band in range(carried.shape[0]):
        carried[band] *= reflection[band]
        total += carried[band]
    return total / carried.shape[0]


@njit(cache=True)
def _turn(direction, carried, room, quad, weighted, seed, ray, turn) -> None:  # type: ignore[no-untyped-def]
    """Reflect a ray. The kind is drawn by the mean scattering over the bands.

    Where `weighted`, the share of each band that goes that way makes up for it.
    """
    chance = room.mean_scattering[quad]
    specular = uniform(seed, ray, turn, 0) >= chance
    if weighted and 0.0 < chance < 1.0:
        for band in range(carried.shape[0]):
            share = room.scattering[quad, band]
            carried[band] *= (1 - share) / (1 - chance) if specular else share / chance
    one, two = uniform(seed, ray, turn, 1), uniform(seed, ray, turn, 2)
    reflect(direction, room.axis[quad], specular, one, two)


@njit(cache=True)
def _copies(ratio: float, draw: float) -> tuple[int, float]:
    """Into how many a ray splits, or 0, and the share of its energy that each goes on with.

    `ratio` is its energy by that which is wanted.
    """
    if ratio > _BAND:
        count = min(int(ratio + 0.5), _SPLIT)
        return count, 1.0 / count
    if ratio < 1.0 / _BAND:
        return (1, 1.0 / ratio) if draw < ratio else (0, 0.0)
    return 1, 1.0


@njit(cache=True)
def trace_rays(  # type: ignore[no-untyped-def]
    first: int,
    directions,
    source,
    room: Room,
    air,
    listeners: Listeners,
    window: Window,
    limits: Limits,
    seed: int,
    record: Record,
) -> tuple[int, int]:
    """Follow rays from number `first` on and record what listeners receive.

    Returns the ray to go on with (their number when all are done) and the count of events. A ray
    whose events find no room in `record` is taken back whole, with what it split into.
    """
    rays, people = directions.shape[0], listeners.centres.shape[0]
    met = Met(
        np.full(people, -1, np.int64),
        np.empty(people, np.int64),
        np.empty(people),
        np.empty(people),
    )
    # What waits to be followed: position, direction, way, and energies; reflection, quad, branch.
    waiting, counts = np.empty((_WAITING, 7 + air.shape[0])), np.empty((_WAITING, 3), np.int64)
    written, stamp = 0, 0
    for ray in range(first, rays):
        before = written
        limit = limits.late_reach if ray % limits.late_every == 0 else limits.reach
        waiting[0, 0:3], waiting[0, 3:6], waiting[0, 6] = source, directions[ray], 0.0
        waiting[0, 7:] = 1.0 / rays
        counts[0, 0], counts[0, 1], counts[0, 2] = 0, -1, 0
        top, branches = 1, 1
        while top > 0:
            top -= 1
            position, direction = waiting[top, 0:3].copy(), waiting[top, 3:6].copy()
            travelled, carried = waiting[top, 6], waiting[top, 7:].copy()
            bounce, quad, branch = counts[top, 0], counts[top, 1], counts[top, 2]
            while True:
                turn = bounce + _FAR * branch
                if quad >= 0:
                    _turn(
                        direction, carried, room, quad, bounce <= limits.weighted, seed, ray, turn
                    )
                length, quad = nearest_hit(position, direction, room)
                length = min(length, limit - travelled)
                if bounce > 0:  # the direct sound is not the tracer's business
                    stamp += 1
                    count = passed_listeners(position, direction, length, listeners, met, stamp)
                    if written + count > record.listener.shape[0]:
                        return ray, before
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
                        limits,
                        seed,
                        ray,
                        turn,
                    )
                    written += count
                travelled += length
                bounce += 1
                if quad < 0 or travelled >= limit or bounce > limits.depth:
                    break
                for i in range(3):
                    position[i] += length * direction[i]
                position[room.axis[quad]] = room.offset[quad]
                loud = _swallow(carried, room.reflection[quad])
                wanted = wanted_energy(window, position, travelled)
                if loud * rays < limits.floor:
                    break
                if wanted > 0.0:
                    copies, share = _copies(loud / wanted, uniform(seed, ray, turn, 3))
                    if copies == 0:
                        break
                    carried *= share
                    for _ in range(min(copies - 1, _WAITING - top)):
                        waiting[top, 0:3], waiting[top, 3:6] = position, direction
                        waiting[top, 6], waiting[top, 7:] = travelled, carried
                        counts[top, 0], counts[top, 1], counts[top, 2] = bounce, quad, branches
                        branches += 1
                        top += 1
    return rays, written
