"""Fields of sound on partial graphs: length and first direction of the path to each square.

Sound that walls block arrives along the shortest path around them. For an agent at one square of
its map, a field has for every other square the length of the shortest path to it, and the direction
in which this path leaves: towards the square if no square in between is blocked, else towards the
last square of the path that is in sight. Paths go to all eight neighbours of a square and are found
with a queue of buckets (Dial, "Algorithm 360: shortest-path forest with topological ordering",
Communications of the ACM 12, 1969).
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

# Units of length on a free square, straight and diagonal; their ratio is sqrt(2) within 1 %.
STRAIGHT, DIAGONAL = 5, 7
# Length of what was not reached, and factor from units to squares.
UNREACHED = 32767
SQUARES = 1.0 / STRAIGHT
_BUCKETS = 64
# Longest step in units, so that the queue has a bucket for each; half of the buckets.
_LONGEST = 31


@numba.njit(cache=True, parallel=True)
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
    cost : (N, M, M) float32
        Cost of entering each square, 1 or more; infinite without a node. See `PartialGraph`. A step
        has at most 31 units of length, so costs above 4.4 are 4.4 on a diagonal, above 6.2 else.
    position : (N, K, 2) int64
        Column and row at which each of N agents has been K times.
    row, slot : (R,) int64
        Indices of the fields: agent, and place from which they are seen.
    reach : int
        Squares up to which paths are followed.
    bins : int
        Number of directions B, at most 255; bin b is centred at b/B turns clockwise from the front
        of the map.
    length : (N, K, M, M) int16
        Set to the length of the path to each square, in units of `SQUARES`; `UNREACHED` beyond.
    direction : (N, K, M, M) uint8
        Set to the bin of the direction in which it leaves; `bins` where the agent is, and beyond.
    """
    for i in numba.prange(len(row)):
        n, k = row[i], slot[i]
        _field(cost[n], position[n, k], reach, bins, length[n, k], direction[n, k])


@numba.njit(cache=True)
def _field(cost, position, reach, bins, length, direction):  # type: ignore[no-untyped-def]
    size = cost.shape[0]
    length[:], direction[:] = UNREACHED, bins
    first = np.full(_BUCKETS, -1, dtype=np.int32)
    capacity = 9 * size * size
    waiting = np.empty(capacity, dtype=np.int32)
    following = np.empty(capacity, dtype=np.int32)
    # square from which the straight line ends: -1 while the square itself is in sight
    bend = np.full(size * size, -1, dtype=np.int32)
    before = np.full(size * size, -1, dtype=np.int32)
    closed = np.zeros(size * size, dtype=np.bool_)
    px, py = position[0], position[1]
    start = py * size + px
    length[py, px] = 0
    waiting[0], following[0], first[0] = start, -1, 0
    used, left, now, most = 1, 1, 0, reach * STRAIGHT
    while left and now <= most:
        bucket = now % _BUCKETS
        while first[bucket] >= 0:
            entry = first[bucket]
            first[bucket] = following[entry]
            left -= 1
            square = waiting[entry]
            y, x = square // size, square % size
            if closed[square] or length[y, x] != now:
                continue
            closed[square] = True
            if square != start:
                parent = before[square]
                if bend[parent] >= 0:
                    bend[square] = bend[parent]
                elif not _clear(cost, px, py, x, y):
                    bend[square] = parent
                aim = square if bend[square] < 0 else bend[square]
                direction[y, x] = _bin(aim % size - px, aim // size - py, bins)
            for v in range(max(y - 1, 0), min(y + 2, size)):
                for u in range(max(x - 1, 0), min(x + 2, size)):
                    there = v * size + u
                    if closed[there] or cost[v, u] == np.inf:
                        continue
                    step = STRAIGHT
                    if u != x and v != y:
                        if cost[v, x] == np.inf and cost[y, u] == np.inf:
                            continue
                        step = DIAGONAL
                    total = now + min(int(step * cost[v, u] + 0.5), _LONGEST)
                    if total < length[v, u]:
                        length[v, u], before[there] = total, square
                        slot = total % _BUCKETS
                        waiting[used], following[used] = there, first[slot]
                        first[slot] = used
                        used += 1
                        left += 1
        now += 1


@numba.njit(cache=True)
def _bin(right, front, bins):  # type: ignore[no-untyped-def]
    turns = math.atan2(right, front) / (2 * math.pi)
    return round(turns * bins) % bins


@numba.njit(cache=True)
def _clear(cost, x0, y0, x1, y1):  # type: ignore[no-untyped-def]
    # squares on the line between the centres (Bresenham), without its ends
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx, sy = (1 if x1 > x0 else -1), (1 if y1 > y0 else -1)
    error, x, y = dx - dy, x0, y0
    while True:
        twice = 2 * error
        if twice > -dy:
            error -= dy
            x += sx
        if twice < dx:
            error += dx
            y += sy
        if x == x1 and y == y1:
            return True
        if cost[y, x] == np.inf:
            return False
