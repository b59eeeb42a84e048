"""Shortest paths round the corners of walls, in plan view.

A shortest path among solid blocks is a chain of straight segments whose bends are corners of
blocks, so it is a shortest path in the visibility graph of the corners (Dijkstra's algorithm).
Heights change linearly along the path, which is exact for diffraction at vertical edges. Furniture
and lintels are left out: sound passes over or under them with little loss.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

_CLEARANCE = 1e-3  # metres between a bend and its corner, so that no segment touches its own wall
_PAIRS_AT_ONCE = 20000


@dataclass(frozen=True)
class Paths:
    """Direct paths from a source to L receivers.

    Attributes
    ----------
    length : (L,) float64
        Metres; infinite where there is no path.
    arrival : (L, 3) float64
        Unit vectors from the receiver towards the source, or towards the last corner.
    detour : (L,) float64
        Excess length over the straight line, metres.
    bent : (L,) bool
        True where the path is diffracted: a wall blocks the straight line.
    """

    length: NDArray[np.float64]
    arrival: NDArray[np.float64]
    detour: NDArray[np.float64]
    bent: NDArray[np.bool_]


def sees(
    walls: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Test N line segments against all walls.

    Parameters
    ----------
    walls : array, shape (W, 4)
        Solid blocks x0, y0, x1, y1 in metres.
    start, end : array, shape (N, 2)
        Ends of the segments, metres.

    Returns
    -------
    bool array, shape (N,)
        True where the segment crosses no wall.
    """
    clear = np.empty(len(start), dtype=bool)
    for first in range(0, len(start), _PAIRS_AT_ONCE):
        part = slice(first, first + _PAIRS_AT_ONCE)
        clear[part] = _sees(walls, start[part], end[part])
    return clear


def _sees(
    walls: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.bool_]:
    slope = end - start
    # A line along an axis never enters or leaves that slab; a tiny slope says so without 0/0.
    slope = np.where(np.abs(slope) < 1e-12, 1e-12, slope)[:, None, :]
    one = (walls[None, :, :2] - start[:, None, :]) / slope
    other = (walls[None, :, 2:] - start[:, None, :]) / slope
    enter = np.maximum(np.minimum(one, other).max(axis=2), 0.0)
    leave = np.minimum(np.maximum(one, other).min(axis=2), 1.0)
    blocked: NDArray[np.bool_] = (leave - enter > 1e-9).any(axis=1)
    return ~blocked


def wall_corners(walls: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners outside of all walls, shape (K, 2), moved out by `_CLEARANCE`."""
    x0, y0, x1, y1 = walls.T
    x0, y0, x1, y1 = x0 - _CLEARANCE, y0 - _CLEARANCE, x1 + _CLEARANCE, y1 + _CLEARANCE
    corners = np.stack(
        [np.stack(pair, axis=1) for pair in ((x0, y0), (x1, y0), (x0, y1), (x1, y1))], axis=1
    ).reshape(-1, 2)
    points = corners[:, None]
    nearest = np.clip(points, walls[None, :, :2], walls[None, :, 2:])
    buried = np.any(np.all(points == nearest, axis=2), axis=1)
    return corners[np.logical_not(buried)]


def _visible_distances(
    walls: NDArray[np.float64], one: NDArray[np.float64], other: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Compute the distances (N, M) between mutually visible points; the others are infinite."""
    pairs = np.broadcast_arrays(one[:, None], other[None])
    start, end = (np.reshape(points, (-1, 2)) for points in pairs)
    distance = np.where(sees(walls, start, end), np.hypot(*(end - start).T), np.inf)
    return distance.reshape(len(one), len(other))


def straight_paths(source: NDArray[np.float64], receivers: NDArray[np.float64]) -> Paths:
    """Return the straight lines from a source (3,) to receivers (L, 3), through all walls."""
    offset = np.asarray(source, dtype=np.float64) - receivers
    length = np.linalg.norm(offset, axis=1)
    receiver_count = len(receivers)
    bent = np.zeros(receiver_count, dtype=bool)
    return Paths(length, offset / length[:, None], np.zeros(receiver_count), bent)


def diffracted_paths(
    walls: NDArray[np.float64], source: NDArray[np.float64], receivers: NDArray[np.float64]
) -> Paths:
    """Compute the shortest paths from a source to receivers that pass through no wall.

    Parameters
    ----------
    walls : array, shape (W, 4)
        Solid blocks x0, y0, x1, y1 in plan, metres, doorways left out.
    source : array, shape (3,)
        Position, metres.
    receivers : array, shape (L, 3)
        Positions, metres.

    Returns
    -------
    Paths
        Straight lines where no wall blocks them, else paths round corners.
    """
    straight = straight_paths(source, receivers)
    here, there = np.asarray(source, dtype=np.float64)[None, :2], receivers[:, :2]
    bent = ~sees(walls, np.broadcast_to(here, there.shape), there)
    if not bent.any():
        return straight
    corners = wall_corners(walls)
    nodes = np.concatenate([here, corners])
    graph = _visible_distances(walls, nodes, nodes)
    # scipy takes zeros for missing edges: a point has no edge to itself.
    matrix = csr_array(np.where(np.isfinite(graph), graph, 0.0))
    to_corner = np.asarray(dijkstra(matrix, indices=[0]))[0, 1:]
    lengths = _visible_distances(walls, there[bent], corners) + to_corner
    last = lengths.argmin(axis=1)
    plan_length = lengths[np.arange(len(lengths)), last]
    rise = source[2] - receivers[bent, 2]
    length = np.hypot(plan_length, rise)
    to_last = corners[last] - there[bent]
    # The unit vector has the slope of the whole path.
    level = np.cos(np.arctan2(rise, plan_length)) / np.hypot(*to_last.T)
    arrival = np.column_stack([to_last * level[:, None], np.sin(np.arctan2(rise, plan_length))])
    result = Paths(straight.length.copy(), straight.arrival.copy(), straight.detour.copy(), bent)
    result.detour[bent] = length - straight.length[bent]
    result.length[bent] = length
    result.arrival[bent] = arrival
    return result
