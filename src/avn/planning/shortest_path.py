"""Shortest paths on N partial graphs: A* search.

The nodes are squares of a map with a heading each. The heuristic, the moves along both axes, is
consistent, so the paths have the cost that Dijkstra's algorithm finds, while fewer nodes are
expanded (Hart, Nilsson and Raphael, "A Formal Basis for the Heuristic Determination of Minimum Cost
Paths", 1968).
"""

from __future__ import annotations

import heapq

import numba
import numpy as np
from numpy.typing import NDArray

from avn.core.actions import BACKWARD, FORWARD, ROTATE_LEFT

NO_ACTION = -1
_EMPTY = np.inf


@numba.njit(cache=True)
def first_actions(
    cost: NDArray[np.float32],
    walls: NDArray[np.uint8],
    pose: NDArray[np.int64],
    target: NDArray[np.int64],
    fallback: NDArray[np.float64],
    turn: float,
    back: float,
    active: NDArray[np.bool_],
    reach: int = 0,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Find the first action of each agent's shortest path to its target.

    If a target cannot be reached, the path leads to the reachable node nearest to `fallback`.

    Parameters
    ----------
    cost : (N, M, M) float32
        Cost of entering each square, 1 or more; infinite without a node. By square to the front
        and square to the right.
    walls : (N, M, M) uint8
        Bit h is set if there is no edge along heading h.
    pose : (N, 3) int64
        Column, row and heading of the agents, counted from the corner of the map.
    target : (N, 2) int64
        Column and row of the end of each path.
    fallback : (N, 2) float64
        Column and row that the path approaches if the target cannot be reached.
    turn : float
        Cost of a quarter turn.
    back : float
        Additional cost of a move backward; infinite to exclude it.
    active : (N,) bool
        Agents to plan for.
    reach : int
        Squares, including diagonals, that the end of a path may lie from its target.

    Returns
    -------
    action : (N,) int64
        First action; -1 if the path has none or the agent is not active.
    length : (N,) float64
        Cost of the path.
    end : (N, 2) int64
        Column and row of its end.
    """
    count, size = cost.shape[0], cost.shape[1]
    action = np.full(count, NO_ACTION, dtype=np.int64)
    length = np.zeros(count)
    end = pose[:, :2].copy()
    best = np.full(size * size * 4, _EMPTY)
    first = np.full(size * size * 4, NO_ACTION, dtype=np.int8)
    touched = np.empty(size * size * 4, dtype=np.int64)
    for n in range(count):
        if active[n]:
            how = (turn, back, reach)
            action[n], length[n], reached, used = _search(
                cost[n], walls[n], pose[n], target[n], fallback[n], how, best, first, touched
            )
            end[n, 0], end[n, 1] = reached % size, reached // size
            for i in range(used):
                best[touched[i]] = _EMPTY
    return action, length, end


@numba.njit(cache=True)
def _search(cost, walls, pose, target, fallback, how, best, first, touched):  # type: ignore[no-untyped-def]
    turn, back, reach = how
    size = cost.shape[0]
    start = (pose[1] * size + pose[0]) * 4 + pose[2]
    best[start], first[start] = 0.0, NO_ACTION
    touched[0], used = start, 1
    heap = [(_bound(pose[0], pose[1], target, reach), 0.0, start)]
    nearest, found, found_length = np.inf, start, 0.0
    while len(heap):
        _, so_far, node = heapq.heappop(heap)
        if so_far > best[node]:
            continue
        square, heading = node // 4, node % 4
        x, y = square % size, square // size
        if abs(x - target[0]) <= reach and abs(y - target[1]) <= reach:
            return first[node], so_far, square, used
        away = (x - fallback[0]) ** 2 + (y - fallback[1]) ** 2
        if away < nearest:
            nearest, found, found_length = away, node, so_far
        for move in range(4):
            if move >= ROTATE_LEFT:
                after = square * 4 + (heading + (3 if move == ROTATE_LEFT else 1)) % 4
                total = so_far + turn
            else:
                if move == BACKWARD and back == np.inf:
                    continue
                way = heading if move == FORWARD else (heading + 2) % 4
                u = x + (way == 1) - (way == 3)
                v = y + (way == 0) - (way == 2)
                if u < 0 or v < 0 or u >= size or v >= size or walls[y, x] >> way & 1:
                    continue
                if cost[v, u] == np.inf:
                    continue
                after = (v * size + u) * 4 + heading
                total = so_far + cost[v, u] + (back if move == BACKWARD else 0.0)
            if total < best[after] - 1e-9:
                if best[after] == _EMPTY:
                    touched[used] = after
                    used += 1
                best[after] = total
                first[after] = move if node == start else first[node]
                there = after // 4
                heapq.heappush(
                    heap, (total + _bound(there % size, there // size, target, reach), total, after)
                )
    return first[found], found_length, found // 4, used


@numba.njit(cache=True)
def _bound(x: int, y: int, target: NDArray[np.int64], reach: int) -> float:
    return float(max(abs(x - target[0]) - reach, 0) + max(abs(y - target[1]) - reach, 0))
