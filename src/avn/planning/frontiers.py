"""Frontiers: borders between known free squares and unknown ones on the maps of N agents.

Squares are free, blocked or unknown as their probability of being free is above, below or at its
first value of 0.5, and a frontier is a free square next to an unknown one (Yamauchi, "A
Frontier-Based Approach for Autonomous Exploration", CIRA 1997).
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

# Probability of a square of which nothing is known.
UNKNOWN = 0.5


@numba.njit(cache=True, parallel=True)
def frontiers_towards(
    belief: NDArray[np.float32],
    walls: NDArray[np.uint8],
    position: NDArray[np.int64],
    direction: NDArray[np.float64],
    sector: float,
    active: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Find the reachable frontier nearest to a direction, and the unknown square beyond it.

    Reachable are free squares that a walk over free squares leads to. The direction of a frontier
    is that of the unknown square beyond it, so that the frontier at which an agent stands has one
    too. Of several in one sector around the direction, the one of the fewest moves is chosen.

    Parameters
    ----------
    belief : (N, M, M) float32
        Probability that each square is free, by square to the front and square to the right.
    walls : (N, M, M) uint8
        Bit h is set if there is no edge along heading h.
    position : (N, 2) int64
        Column and row of the agents.
    direction : (N,) float64
        Turns clockwise from the front of the map.
    sector : float
        Angle between the bounds of two sectors on one side of the direction, turns.
    active : (N,) bool
        Agents to choose for.

    Returns
    -------
    beyond : (N, 2) int64
        Column and row of the unknown square; the agent's own where there is no frontier.
    found : (N,) bool
        True if there is a frontier.
    """
    beyond, found = position.copy(), np.zeros(len(belief), dtype=np.bool_)
    for n in numba.prange(len(belief)):
        if active[n]:
            found[n] = _towards(belief[n], walls[n], position[n], direction[n], sector, beyond[n])
    return beyond, found


@numba.njit(cache=True)
def _towards(belief, walls, position, direction, sector, beyond):  # type: ignore[no-untyped-def]
    size = belief.shape[0]
    moves = np.full(size * size, -1, dtype=np.int32)
    queue = np.empty(size * size, dtype=np.int32)
    start = position[1] * size + position[0]
    queue[0], moves[start], head, tail = start, 0, 0, 1
    nearest = np.inf
    while head < tail:
        square = queue[head]
        head += 1
        y, x = square // size, square % size
        for way in range(4):
            u = x + (way == 1) - (way == 3)
            v = y + (way == 0) - (way == 2)
            if u < 0 or v < 0 or u >= size or v >= size or walls[y, x] >> way & 1:
                continue
            if belief[v, u] == UNKNOWN:
                turns = math.atan2(u - position[0], v - position[1]) / (2 * math.pi)
                away = abs((turns - direction + 0.5) % 1.0 - 0.5)
                # the queue is in the order of moves, so the first of a sector has the fewest
                if away // sector < nearest:
                    nearest = away // sector
                    beyond[0], beyond[1] = u, v
            elif belief[v, u] > UNKNOWN and moves[v * size + u] < 0:
                moves[v * size + u] = moves[square] + 1
                queue[tail] = v * size + u
                tail += 1
    return nearest < np.inf
