"""How many rays go where: so many that every place hears about as many, none much louder.

Left to themselves, rays fill an apartment evenly while their energies drift apart by orders of
magnitude; few loud ones then decide what is heard late or in a far room. So a short survey measures
the mean energy by place and time. In the main run a ray that is much louder than that splits, and
one that is much quieter ends by chance, its energy handed to the survivors (a weight window, as in
neutron transport: T. E. Booth and J. S. Hendricks, Nuclear Technology / Fusion 5, 1984). Neither
changes the expected energy anywhere, however rough the survey is.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from avn.acoustics.kernels import Room, nearest_hit, reflect, uniform

CELL = 1.0  # metres
STEP = 8.0  # metres of the way: about 23 ms
_SAMPLE = 0.5  # metres between the points at which a stretch is counted


class Window(NamedTuple):
    """The energy wanted of a ray, by place and way travelled.

    `low` (2,) is the corner of the grid over x and y; `target` (nx, ny, steps) the energy, 0 where
    it is not known.
    """

    low: NDArray[np.float64]
    target: NDArray[np.float64]


@njit(cache=True)
def wanted_energy(window: Window, position, travelled: float) -> float:  # type: ignore[no-untyped-def]
    """The energy wanted of a ray that is at a position after a way."""
    nx, ny, steps = window.target.shape
    ix = min(max(int((position[0] - window.low[0]) / CELL), 0), nx - 1)
    iy = min(max(int((position[1] - window.low[1]) / CELL), 0), ny - 1)
    return window.target[ix, iy, min(int(travelled / STEP), steps - 1)]


@njit(cache=True)
def _count(tally, low, position, direction, length, travelled, energy) -> None:  # type: ignore[no-untyped-def]
    pieces = int(length / _SAMPLE) + 1
    _, nx, ny, steps = tally.shape
    for piece in range(pieces):
        way = (piece + 0.5) * length / pieces
        ix = int((position[0] + way * direction[0] - low[0]) / CELL)
        iy = int((position[1] + way * direction[1] - low[1]) / CELL)
        step = int((travelled + way) / STEP)
        if 0 <= ix < nx and 0 <= iy < ny and step < steps:
            tally[0, ix, iy, step] += length / pieces
            tally[1, ix, iy, step] += energy * length / pieces


@njit(cache=True)
def _survey(
    directions, source, room: Room, reach: float, depth: int, seed: int, low, tally
) -> None:  # type: ignore[no-untyped-def]
    """Count metres, and energy x metres, of rays by place and way."""
    position, direction = np.empty(3), np.empty(3)
    carried = np.empty(room.reflection.shape[1])
    for ray in range(directions.shape[0]):
        position[:] = source
        direction[:] = directions[ray]
        carried[:] = 1.0
        travelled = 0.0
        for bounce in range(depth + 1):
            length, quad = nearest_hit(position, direction, room)
            length = min(length, reach - travelled)
            _count(tally, low, position, direction, length, travelled, carried.mean())
            travelled += length
            if quad < 0 or travelled >= reach:
                break
            axis = room.axis[quad]
            for i in range(3):
                position[i] += length * direction[i]
            position[axis] = room.offset[quad]
            carried *= room.reflection[quad]
            specular = uniform(seed, ray, bounce, 0) >= room.mean_scattering[quad]
            one, two = uniform(seed, ray, bounce, 1), uniform(seed, ray, bounce, 2)
            reflect(direction, axis, specular, one, two)


def survey(
    directions: NDArray[np.float64],
    source: NDArray[np.float64],
    room: Room,
    reach: float,
    depth: int,
    seed: int,
    rays: int,
) -> Window:
    """The window for a run of `rays` rays, from a survey with fewer directions (n, 3)."""
    bounds = np.concatenate([_bounds(room, low=True), _bounds(room, low=False)])
    low, high = bounds[:2], bounds[2:]
    shape = np.maximum(np.ceil((high - low) / CELL), 1).astype(int)
    tally = np.zeros((2, *shape, math.ceil(reach / STEP)))
    _survey(directions, source, room, reach, depth, seed, low, tally)
    metres, energy = tally
    # Rays that mix fill the air evenly, so metres stand for the volume of air at a place.
    volume = metres.sum(axis=2, keepdims=True) / max(metres.sum(), 1e-12)
    evenly = volume * metres.sum(axis=(0, 1), keepdims=True)
    target = np.divide(energy, evenly, out=np.zeros_like(energy), where=evenly > 0)
    return Window(low, target / rays)


def _bounds(room: Room, low: bool) -> NDArray[np.float64]:
    """The least or greatest x and y of all rectangles."""
    side, pick = (room.lower, np.min) if low else (room.upper, np.max)
    values = []
    for axis in range(2):
        own = room.offset[room.axis == axis]
        # The bounds on the two other axes are in ascending order of axis.
        others = [
            side[room.axis == a, axis if a > axis else axis - 1] for a in range(3) if a != axis
        ]
        values.append(pick(np.concatenate([own, *others])))
    return np.array(values)
