import networkx as nx
import numpy as np
import pytest

from avn.planning.shortest_path import NO_ACTION, first_actions

FORWARD, BACKWARD, LEFT, RIGHT = range(4)
STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0))


def state_graph(cost: np.ndarray, walls: np.ndarray, turn: float, back: float) -> nx.DiGraph:
    """The same graph for networkx: nodes (column, row, heading)."""
    size, graph = len(cost), nx.DiGraph()
    for x, y, h in np.ndindex(size, size, 4):
        for action, after in ((LEFT, (h - 1) % 4), (RIGHT, (h + 1) % 4)):
            graph.add_edge((x, y, h), (x, y, after), weight=turn, action=action)
        for action, way in ((FORWARD, h), (BACKWARD, (h + 2) % 4)):
            u, v = x + STEPS[way][0], y + STEPS[way][1]
            outside = not (0 <= u < size and 0 <= v < size)
            if outside or np.isinf(cost[v, u]) or walls[y, x] >> way & 1:
                continue
            extra = back if action == BACKWARD else 0.0
            if np.isfinite(extra):
                graph.add_edge((x, y, h), (u, v, h), weight=cost[v, u] + extra, action=action)
    return graph


def random_graphs(count: int, size: int = 9) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(7)
    cost = (1 + 2 * rng.random((count, size, size))).astype(np.float32)
    cost[rng.random(cost.shape) < 0.3] = np.inf
    walls = np.zeros((count, size, size), dtype=np.uint8)
    for heading, (dx, dy) in enumerate(STEPS[:2]):
        shut = rng.random(walls.shape) < 0.1
        walls |= (shut << heading).astype(np.uint8)
        beyond = np.roll(shut, (dy, dx), axis=(1, 2))
        walls |= (beyond << (heading + 2)).astype(np.uint8)
    pose = np.stack([rng.integers(0, n, count) for n in (size, size, 4)], axis=1)
    return cost, walls, pose, rng.integers(0, size, (count, 2))


@pytest.mark.parametrize(("turn", "back"), [(0.01, np.inf), (1.0, np.inf), (1.0, 0.0), (0.5, 2.0)])
def test_paths_are_those_of_networkx(turn: float, back: float) -> None:
    cost, walls, pose, target = random_graphs(60)
    active = np.ones(len(cost), dtype=bool)
    fallback = target.astype(float)
    action, length, end = first_actions(cost, walls, pose, target, fallback, turn, back, active)
    unreachable = 0
    for n in range(len(cost)):
        graph = state_graph(cost[n], walls[n], turn, back)
        start = tuple(int(v) for v in pose[n])
        lengths = nx.single_source_dijkstra_path_length(graph, start)
        ends = {h: lengths.get((*target[n].tolist(), h), np.inf) for h in range(4)}
        if np.isinf(min(ends.values())):
            # Out of reach: the nearest node that is not.
            unreachable += 1
            away = {
                node: (node[0] - fallback[n, 0]) ** 2 + (node[1] - fallback[n, 1]) ** 2
                for node in lengths
            }
            nearest = min(away.values())
            assert (end[n, 0] - fallback[n, 0]) ** 2 + (end[n, 1] - fallback[n, 1]) ** 2 == nearest
            best = min(lengths[node] for node in lengths if node[:2] == tuple(end[n]))
        else:
            assert end[n].tolist() == target[n].tolist()
            best = min(ends.values())
        assert length[n] == pytest.approx(best, abs=1e-4)
        if action[n] == NO_ACTION:
            assert best == 0
            continue
        # The first action lies on a shortest path: what is left is shorter by its cost.
        after = next(b for _, b, a in graph.out_edges(start, data="action") if a == action[n])
        left = nx.single_source_dijkstra_path_length(graph, after)
        rest = min(value for node, value in left.items() if node[:2] == tuple(end[n]))
        assert graph.edges[start, after]["weight"] + rest == pytest.approx(best, abs=1e-4)
    assert 5 < unreachable < 55


def test_who_does_not_run_gets_no_action() -> None:
    cost, walls, pose, target = random_graphs(4)
    active = np.array([True, False, True, False])
    action, _, end = first_actions(
        cost, walls, pose, target, target.astype(float), 1.0, np.inf, active
    )
    assert (action[~active] == NO_ACTION).all()
    assert (end[~active] == pose[~active, :2]).all()


def test_where_turns_are_dear_it_walks_backward() -> None:
    cost, walls = np.ones((1, 5, 5), dtype=np.float32), np.zeros((1, 5, 5), dtype=np.uint8)
    pose, target = np.array([[2, 3, 0]]), np.array([[2, 0]])
    yes = np.array([True])
    for back, wanted in ((0.0, BACKWARD), (np.inf, RIGHT)):
        action, _, _ = first_actions(cost, walls, pose, target, target * 1.0, 1.0, back, yes)
        assert action[0] in ((wanted,) if wanted == BACKWARD else (LEFT, RIGHT))
