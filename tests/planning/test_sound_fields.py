import math

import numpy as np
import pytest
from scipy.sparse import lil_array
from scipy.sparse.csgraph import dijkstra

from avn.planning.sound_fields import DIAGONAL, SQUARES, STRAIGHT, sound_fields

BINS = 72


def fields(cost, position, reach=100):
    shape = (len(cost), 1, *cost.shape[1:])
    length, direction = np.empty(shape, np.int16), np.empty(shape, np.uint8)
    rows, first = np.arange(len(cost)), np.zeros(len(cost), np.int64)
    sound_fields(cost, np.array(position)[:, None], rows, first, reach, BINS, length, direction)
    return length[:, 0], direction[:, 0]


def test_without_walls_a_path_leaves_towards_the_square():
    length, direction = fields(np.ones((1, 21, 21), np.float32), [(10, 10)])
    y, x = np.mgrid[:21, :21] - 10
    angle = np.degrees(np.arctan2(x, y)) % 360
    away = (direction[0] * (360 / BINS) - angle + 180) % 360 - 180
    there = (x != 0) | (y != 0)
    assert np.abs(away[there]).max() <= 360 / BINS / 2 + 1e-6
    assert direction[0, 10, 10] == BINS
    # octile lengths are 0 to 9 % above the straight line
    ratio = length[0][there] * SQUARES / np.hypot(x, y)[there]
    assert ratio.min() > 0.98
    assert ratio.max() < 1.09


def test_behind_a_wall_a_path_leaves_towards_its_end():
    cost = np.ones((1, 21, 21), np.float32)
    cost[0, 12, :18] = np.inf  # open at columns 18 to 20
    length, direction = fields(cost, [(10, 10)])
    to_the_end = math.degrees(math.atan2(7.5, 1.5)) * BINS / 360
    assert abs(direction[0, 14, 10] - to_the_end) <= 1
    assert direction[0, 11, 10] == 0
    # 8 squares to the gap and back, not 4 straight ahead
    assert length[0, 14, 10] * SQUARES > 16


@pytest.mark.parametrize("seed", [0, 1])
def test_lengths_are_those_of_scipy(seed):
    rng, size = np.random.default_rng(seed), 25
    cost = rng.choice(np.array([1, 1.5, np.inf], np.float32), (1, size, size), p=[0.6, 0.2, 0.2])
    cost[0, 12, 12] = 1
    graph = lil_array((size * size, size * size))
    for y, x in np.ndindex(size, size):
        for v, u in np.ndindex(3, 3):
            b, a = y + v - 1, x + u - 1
            if (a, b) == (x, y) or not (0 <= a < size and 0 <= b < size):
                continue
            diagonal = a != x and b != y
            shut = diagonal and np.isinf(cost[0, y, a]) and np.isinf(cost[0, b, x])
            if np.isfinite(cost[0, b, a]) and not shut:
                step = DIAGONAL if diagonal else STRAIGHT
                graph[y * size + x, b * size + a] = int(step * cost[0, b, a] + 0.5)
    expected = dijkstra(graph.tocsr(), indices=12 * size + 12).reshape(size, size)
    length, direction = fields(cost, [(12, 12)], reach=200)
    reached = np.isfinite(expected)
    assert np.array_equal(length[0][reached], expected[reached])
    assert (direction[0][~reached] == BINS + 1).all()


def test_what_is_beyond_the_reach_is_not_followed():
    _length, direction = fields(np.ones((1, 41, 41), np.float32), [(20, 20)], reach=5)
    assert direction[0, 20, 25] != BINS
    assert direction[0, 20, 27] == BINS + 1


def test_agents_are_independent():
    rng = np.random.default_rng(0)
    cost = np.where(rng.random((5, 31, 31)) < 0.25, np.inf, 1.0).astype(np.float32)
    position = [(5, 5), (15, 20), (30, 0), (1, 29), (15, 15)]
    together = fields(cost, position)
    for n in range(5):
        alone = fields(cost[n : n + 1], position[n : n + 1])
        assert all(np.array_equal(a[n], b[0]) for a, b in zip(together, alone, strict=True))
