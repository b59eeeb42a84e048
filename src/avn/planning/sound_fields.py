"""Fields of sound on partial graphs: length and first direction of the path to each square.

Sound that walls block arrives along the shortest path around them. For an agent at one square of
its map, a field has for every other square the length of the shortest path to it, and the direction
in which this path leaves: towards the square if no square in between is blocked, else towards the
last square of the path that is in sight. Paths go to all eight neighbours of a square and are found
with a queue of buckets (Dial, "Algorithm 360: shortest-path forest with topological ordering",
Communications of the ACM 12, 1969), which are stacks. When the map changes, fields are repaired:
see `field_search`.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from avn.planning.field_changes import differences, missed, note_changes, units
from avn.planning.field_search import new_workspace, repair
from avn.planning.field_state import DIAGONAL, NOWHERE, STRAIGHT, UNKNOWN, UNREACHED

__all__ = ["DIAGONAL", "SQUARES", "STRAIGHT", "UNREACHED", "SoundFields", "sound_fields"]

# Factor from units of length to squares.
SQUARES = 1.0 / STRAIGHT
# Changes of each map that are remembered; if there were more, its fields are computed anew.
_REMEMBERED = 512


class SoundFields:
    """Fields of K places of each of N agents, kept up to date with their maps.

    Parameters
    ----------
    n, places, size : int
        N, K, and squares M along each side of a map.
    reach : int
        Squares up to which paths are followed.
    bins : int
        Number of directions B, at most 254; bin b is centred at b/B turns clockwise from the front
        of the map.

    Attributes
    ----------
    length : (N, K, M, M) int16
        Length of the path to each square, in units of `SQUARES`; `UNREACHED` beyond.
    direction : (N, K, M, M) uint8
        Bin of the direction in which it leaves; B where the agent is, and B + 1 beyond.
    framed : pair of (N, K, M + 2, M + 2) arrays
        Both with a margin of one square, contiguous.
    """

    def __init__(self, n: int, places: int, size: int, reach: int, bins: int) -> None:
        self.reach, self.bins = reach, bins
        width = size + 2
        shape = (n, places, width, width)
        self.framed = (
            np.full(shape, UNREACHED, dtype=np.int16),
            np.full(shape, bins + 1, dtype=np.uint8),
        )
        self._state = np.full(shape, NOWHERE, dtype=np.uint8)
        self.length, self.direction = (own[:, :, 1:-1, 1:-1] for own in self.framed)
        # the maps of now, and the units of a straight and a diagonal step to each square
        self._cost = np.full((n, size, size), np.nan, dtype=np.float32)
        self._steps = np.zeros((n, 2, width, width), dtype=np.uint8)
        # a ring of changes of each map, their number, and how many each field knows
        self._changes = np.zeros((n, _REMEMBERED), dtype=np.int32)
        self._changed = np.zeros(n, dtype=np.int64)
        self._known = np.full((n, places), -1, dtype=np.int64)
        # whether no square has become a node, or is none any more, since a field was computed
        self._valid = np.zeros((n, places), dtype=np.bool_)
        # length up to which each field is right
        self._limit = np.full((n, places), reach * STRAIGHT, dtype=np.int64)
        self._aims = _aims(size, bins)
        self._plain: tuple[Any, ...] | None = None

    def forget(self, row: NDArray[np.int64], slot: NDArray[np.int64]) -> None:
        """Forget the fields of places with new positions, (R,) agents and (R,) places."""
        self._valid[row, slot], self._known[row, slot] = False, -1

    def update(
        self,
        cost: NDArray[np.float32],
        position: NDArray[np.int64],
        wanted: NDArray[np.bool_],
        active: NDArray[np.bool_],
        around: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None,
    ) -> None:
        """Bring fields up to date.

        A field that is there changes only where a square has become a node, or is none any more,
        in the map of its agent: then it becomes that of the present costs.

        Parameters
        ----------
        cost : (N, M, M) float32
            Cost of entering each square, 1 or more; infinite without a node. See `PartialGraph`. A
            step has at most 31 units of length, so costs above 4.4 are 4.4 on a diagonal, above
            6.2 else.
        position : (N, K, 2) int64
            Column and row of the places.
        wanted : (N, K) bool
            Fields to bring up to date.
        active : (N,) bool
            Agents whose maps may have changed; `wanted` is of these.
        around : pair of (N,) int64, optional
            One of the K places of each agent, and a length in units of `SQUARES`: only the squares
            to which the path from this place is no longer are brought up to date, and the values of
            others are undefined. By default all are.
        """
        flipped = note_changes(cost, self._cost, self._steps, self._changes, self._changed, active)
        self._valid[flipped] = False
        most = self.reach * STRAIGHT
        if around is None:
            around = np.zeros(len(cost), dtype=np.int64), np.full(len(cost), most)
        rows = np.arange(len(cost))
        x, y = np.moveaxis(position[rows, around[0]], -1, 0)
        # no path from one place is longer than that over another place
        needed = np.minimum(self.length[rows, :, y, x] + around[1][:, None], most)
        row, slot = np.nonzero(wanted & (~self._valid | (needed > self._limit)))
        if not len(row):
            return
        if self._plain is None:
            self._plain = self._uniform(cost[row[0], 0, 0])
        _update(
            (*self.framed, self._state, self._limit),
            self._steps,
            (self._changes, self._changed, self._known),
            (row, slot),
            position,
            around,
            (most, self.bins),
            self._aims,
            self._plain,
            4 * numba.get_num_threads(),
        )
        self._valid[row, slot] = True

    def _uniform(self, cost: np.float32) -> tuple[Any, ...]:
        """Return a field without boundaries or walls, from which fields are made, and its steps."""
        width = 2 * self._cost.shape[1] + 1
        steps = np.zeros((2, width, width), dtype=np.uint8)
        straight, diagonal = units(cost)
        steps[0, 1:-1, 1:-1], steps[1, 1:-1, 1:-1] = straight, diagonal
        length = np.zeros((width, width), dtype=np.int16)
        direction, state = (np.zeros((width, width), dtype=np.uint8) for _ in range(2))
        state[:] = NOWHERE | (0 if straight else UNKNOWN)
        everything = 2 * np.arange(width * width)
        flat = length.ravel(), direction.ravel(), state.ravel()
        start, aims = width * width // 2, _aims(width - 2, self.bins)
        most = self.reach * STRAIGHT
        work = new_workspace(width * width, most)
        repair(flat, steps.reshape(2, -1), start, most, self.bins, aims, everything, work)
        return length, direction, state, straight, diagonal


def sound_fields(
    cost: NDArray[np.float32],
    position: NDArray[np.int64],
    row: NDArray[np.int64],
    slot: NDArray[np.int64],
    reach: int,
    bins: int,
    length: NDArray[np.int16],
    direction: NDArray[np.uint8],
) -> None:
    """Compute R fields, in place.

    Parameters
    ----------
    cost, position, reach, bins
        See `SoundFields`.
    row, slot : (R,) int64
        Indices of the fields: agent, and place from which they are seen.
    length, direction : (N, K, M, M) int16 and uint8
        Set to the values of `SoundFields` for these fields.
    """
    fields = SoundFields(len(cost), position.shape[1], cost.shape[1], reach, bins)
    wanted = np.zeros(position.shape[:2], dtype=np.bool_)
    wanted[row, slot] = True
    active: NDArray[np.bool_] = np.asarray(wanted.any(1))
    fields.update(cost, position, wanted, active)
    length[row, slot] = fields.length[row, slot]
    direction[row, slot] = fields.direction[row, slot]


@numba.njit(cache=True, parallel=True)
def _update(  # type: ignore[no-untyped-def]
    fields, steps, log, chosen, position, around, limits, aims, plain, parts
):
    row, slot = chosen
    most, bins = limits
    width, limit = steps.shape[2], fields[3]
    flat = width * width
    parts = min(parts, len(row))
    for part in numba.prange(parts):
        workspace = new_workspace(flat, most)
        listed = np.empty(max(flat, log[0].shape[1]), dtype=np.int32)
        for i in range(part, len(row), parts):
            n, k = row[i], slot[i]
            x, y = position[n, k, 0], position[n, k, 1]
            field = (
                fields[0][n, k].reshape(flat),
                fields[1][n, k].reshape(flat),
                fields[2][n, k].reshape(flat),
            )
            own, start = steps[n].reshape((2, flat)), (y + 1) * width + x + 1
            middle, length = position[n, around[0][n]], around[1][n]
            over = (middle[1] + 1) * width + middle[0] + 1
            count = missed(log, n, k, listed)
            # where the middle is not known to be within the limit, the repair shows where it is
            needed = length if count < 0 else limit[n, k]
            if field[0][over] < needed:
                needed = min(field[0][over] + length, most)
            while True:
                # a little farther, as the next ones may have to be
                reached = min(needed + needed // 8 + 2 * STRAIGHT, most)
                if count < 0 or needed > limit[n, k]:  # a field is never repaired farther
                    _copy_uniform(fields, n, k, x, y, plain)
                    count = differences(steps[n], plain[3], plain[4], listed)
                    limit[n, k] = reached
                limit[n, k] = min(limit[n, k], reached)
                repair(field, own, start, limit[n, k], bins, aims, listed[:count], workspace)
                needed, count = min(field[0][over] + length, most), -1
                if needed <= limit[n, k]:
                    break
            log[2][n, k] = log[1][n]


@numba.njit(cache=True)
def _copy_uniform(fields, n, k, x, y, plain):  # type: ignore[no-untyped-def]
    """Set a field to the part of the uniform one around its start, which is in the middle."""
    size = fields[0].shape[2] - 2
    left = size - x
    for row in range(size):
        above = size - y + row
        _copy(fields[0][n, k, row + 1, 1:-1], plain[0][above, left : left + size])
        _copy(fields[1][n, k, row + 1, 1:-1], plain[1][above, left : left + size])
        _copy(fields[2][n, k, row + 1, 1:-1], plain[2][above, left : left + size])


@numba.njit(cache=True)
def _copy(target, source):  # type: ignore[no-untyped-def]
    """Copy a row; over slices, the loop is compiled to one copy."""
    for i in range(len(target)):
        target[i] = source[i]


@numba.njit(cache=True)
def _aims(size, bins):  # type: ignore[no-untyped-def]
    """Return the bin of the direction of each offset in rows and columns, (2 M - 1, 2 M - 1)."""
    aims = np.empty((2 * size - 1, 2 * size - 1), dtype=np.uint8)
    for y in range(2 * size - 1):
        for x in range(2 * size - 1):
            turns = math.atan2(x - size + 1, y - size + 1) / (2 * math.pi)
            aims[y, x] = round(turns * bins) % bins
    return aims
