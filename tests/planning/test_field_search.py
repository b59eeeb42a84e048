"""Repaired fields are those of a whole search, which is written out here without any shortcut."""

import math

import numpy as np
import pytest
from scipy.sparse import lil_array
from scipy.sparse.csgraph import dijkstra

from avn.planning.sound_fields import DIAGONAL, STRAIGHT, UNREACHED, SoundFields, sound_fields

BINS, SIZE = 36, 17
PALETTES = {
    "free": np.array([1.0]),
    "unknown": np.array([1, 1.5]),
    "beliefs": np.linspace(1, 2, 9),
    "dear": np.array([1, 1.5, 3, 9, 1001]),
}


def units(cost, diagonal):
    return min(int((DIAGONAL if diagonal else STRAIGHT) * cost + 0.5), 31)


def line(x0, y0, x1, y1):
    """Squares between two squares: the nearest to the line at each step, halves to the start."""
    dx, dy = x1 - x0, y1 - y0
    steps = max(abs(dx), abs(dy))
    for i in range(1, steps):
        if abs(dx) >= abs(dy):
            away = math.ceil(i * abs(dy) / steps - 0.5)
            yield x0 + int(math.copysign(i, dx)), y0 + int(math.copysign(away, dy))
        else:
            away = math.ceil(i * abs(dx) / steps - 0.5)
            yield x0 + int(math.copysign(away, dx)), y0 + int(math.copysign(i, dy))


def whole_search(cost, place, reach):
    """Length and direction of each square: buckets are stacks, as the module says."""
    size = len(cost)
    length, direction = np.full((size, size), UNREACHED), np.full((size, size), BINS + 1)
    px, py = place
    length[py, px], direction[py, px] = 0, BINS
    buckets, before, aims, done = {0: [(px, py)]}, {}, {(px, py): None}, set()
    for now in range(reach * STRAIGHT + 1):
        stack = buckets.get(now, [])
        while stack:
            x, y = stack.pop()
            if (x, y) in done or length[y, x] != now:
                continue
            done.add((x, y))
            if (x, y) != (px, py):
                parent = before[x, y]
                if aims[parent] is not None:
                    aims[x, y] = aims[parent]
                elif any(cost[v, u] == np.inf for u, v in line(px, py, x, y)):
                    aims[x, y] = parent
                else:
                    aims[x, y] = None
                u, v = aims[x, y] or (x, y)
                direction[y, x] = round(math.atan2(u - px, v - py) / math.tau * BINS) % BINS
            for v in range(max(y - 1, 0), min(y + 2, size)):
                for u in range(max(x - 1, 0), min(x + 2, size)):
                    if (u, v) in done or cost[v, u] == np.inf:
                        continue
                    diagonal = u != x and v != y
                    if diagonal and cost[v, x] == np.inf and cost[y, u] == np.inf:
                        continue
                    total = now + units(cost[v, u], diagonal)
                    if total < length[v, u]:
                        length[v, u], before[u, v] = total, (x, y)
                        buckets.setdefault(total, []).append((u, v))
    return length, direction


def changing_maps(rng, palette, unknown, count):
    """Yield maps: of each the last one with a few squares near another changed."""
    cost = np.full((1, SIZE, SIZE), unknown, np.float32)
    cost[rng.random(cost.shape) < 0.15] = np.inf
    for _ in range(count):
        yield cost
        y, x = rng.integers(0, SIZE, 2)
        patch = cost[0, max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3]
        blocked = rng.random(patch.shape) < rng.choice([0.1, 0.5])
        patch[:] = np.where(blocked, np.inf, rng.choice(palette, patch.shape))


@pytest.mark.parametrize("reach", [6, 60])
@pytest.mark.parametrize("kind", [*PALETTES, "blocked"])
def test_repaired_fields_are_those_of_a_whole_search(kind, reach):
    rng = np.random.default_rng(reach)
    palette = PALETTES.get(kind, PALETTES["free"])
    unknown = np.inf if kind == "blocked" else palette[-1]
    for _ in range(4):
        place, every = rng.integers(0, SIZE, (1, 1, 2)), np.ones((1, 1), np.bool_)
        fields = SoundFields(1, 1, SIZE, reach, BINS)
        blocked, expected = None, None
        for cost in changing_maps(rng, palette, unknown, 6):
            fields.update(cost, place, every, every[0])
            # costs alone do not outdate a field
            if blocked is None or not np.array_equal(np.isinf(cost), blocked):
                blocked, expected = np.isinf(cost), whole_search(cost[0], place[0, 0], reach)
            np.testing.assert_array_equal(fields.length[0, 0], expected[0])
            np.testing.assert_array_equal(fields.direction[0, 0], expected[1])


def test_repaired_lengths_are_those_of_scipy():
    rng, every = np.random.default_rng(3), np.ones((1, 1), np.bool_)
    fields, place = SoundFields(1, 1, SIZE, 200, BINS), np.array([[(8, 8)]])
    for cost in changing_maps(rng, np.array([1.0]), 1.0, 8):
        cost[0, 8, 8] = 1
        fields.update(cost, place, every, every[0])
        graph = lil_array((SIZE * SIZE, SIZE * SIZE))
        free = np.isfinite(cost[0])
        for y, x, b, a in np.ndindex(SIZE, SIZE, 3, 3):
            v, u = y + b - 1, x + a - 1
            if (u, v) == (x, y) or not (0 <= u < SIZE and 0 <= v < SIZE) or not free[v, u]:
                continue
            diagonal = u != x and v != y
            if not diagonal or free[y, u] or free[v, x]:
                graph[y * SIZE + x, v * SIZE + u] = units(1.0, diagonal)
        found = dijkstra(graph.tocsr(), indices=8 * SIZE + 8).reshape(SIZE, SIZE)
        expected = np.where(np.isfinite(found), found, UNREACHED)
        np.testing.assert_array_equal(fields.length[0, 0], expected)


def test_more_changes_than_are_remembered_are_a_new_map():
    rng, size = np.random.default_rng(0), 41
    place, every = np.array([[(20, 20)]]), np.ones((1, 1), np.bool_)
    fields = SoundFields(1, 1, size, 60, BINS)
    for _ in range(3):
        cost = np.where(rng.random((1, size, size)) < 0.3, np.inf, 1.0).astype(np.float32)
        fields.update(cost, place, every, every[0])
        length, direction = np.zeros_like(fields.length), np.zeros_like(fields.direction)
        first = np.zeros(1, np.int64)
        sound_fields(cost, place, first, first, 60, BINS, length, direction)
        assert np.array_equal(fields.length, length)
        assert np.array_equal(fields.direction, direction)


def test_a_forgotten_place_has_the_field_of_its_new_position():
    cost, every = np.ones((1, SIZE, SIZE), np.float32), np.ones((1, 2), np.bool_)
    cost[0, 5, 3:12] = np.inf
    fields, places = SoundFields(1, 2, SIZE, 60, BINS), np.array([[(2, 2), (9, 9)]])
    fields.update(cost, places, every, every[:, 0])
    kept = fields.length[0, 1].copy()
    places[0, 0] = 7, 3
    fields.forget(np.array([0]), np.array([0]))
    fields.update(cost, places, every, every[:, 0])
    assert fields.length[0, 0, 3, 7] == 0
    assert np.array_equal(fields.length[0, 0], whole_search(cost[0], (7, 3), 60)[0])
    assert np.array_equal(fields.length[0, 1], kept)


@pytest.mark.parametrize("kind", ["free", "unknown", "beliefs"])
def test_fields_up_to_a_length_are_those_of_a_whole_search(kind):
    rng, palette, count = np.random.default_rng(5), PALETTES[kind], 4
    rows, every = np.zeros(count, np.int64), np.ones((1, count), np.bool_)
    fields, places = SoundFields(1, count, SIZE, 60, BINS), rng.integers(0, SIZE, (1, count, 2))
    blocked = np.zeros((1, SIZE, SIZE), np.bool_)
    for i, cost in enumerate(changing_maps(rng, palette, palette[-1], 40)):
        slot, most = rng.integers(0, count), rng.integers(1, 80)
        x, y = places[0, slot]
        if i % 5 == 4:
            places[0, slot] = x, y = rng.integers(0, SIZE, 2)
            fields.forget(rows[:1], np.array([slot]))
        cost[0, y, x] = 1
        if np.array_equal(np.isinf(cost), blocked):
            continue  # costs alone do not outdate a field
        blocked = np.isinf(cost)
        fields.update(cost, places, every, every[:, 0], (np.array([slot]), np.array([most])))
        near = whole_search(cost[0], (x, y), 60)[0] <= most
        for k, place in enumerate(places[0]):
            expected = whole_search(cost[0], place, 60)
            assert np.array_equal(fields.length[0, k][near], expected[0][near])
            assert np.array_equal(fields.direction[0, k][near], expected[1][near])
