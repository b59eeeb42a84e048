"""Speed of the planner against networkx and scipy, called once for each episode and step.

All plan on the same partial graphs, those of `plan_noexp` in a hand-drawn flat, and must find paths
of the same cost. The planner is a compiled A* search that stops at the target and also plans where
no path leads there; networkx is a bidirectional Dijkstra search in plain Python, which stops too;
scipy is a compiled Dijkstra search, which has no target and finds the paths to all nodes. A peer
has a graph for each episode; its update is not timed, only its search is. Then whole episodes.

    python benchmarks/planning.py
"""

from __future__ import annotations

import resource
import time

import networkx as nx
import numpy as np
import torch
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from avn.agents import planner_agent
from avn.agents.planner_agent import PlannerAgent
from avn.agents.rollout import Labels, rollout_scene
from avn.apartments.local_patch import window_cells
from avn.dataset.source_locations import relative_locations
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.navigation.episodes import exhaustive_episodes
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.planning import shortest_path
from avn.reporting.results import summarise

VAR = Protocol("var", "box", False, "moves", max_moves_ratio=2.0)
FLAT = """
aaaaaaaa#bbbbbbbb
aaAa##aa#bbbb##bb
aaaa##aa#bbbbbbbb
aaaaaaaaabbb#bbBb
aa##aaaa#bbb#bbbb
aa##aaaa#bbbbbbbb
####a#######b####
ccccccccc#ddddddd
ccCcccccc#dd##ddd
ccc###ccc#ddddDdd
cccccccccccdddddd
cc##ccccC#ddddddd
"""
STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0))
# Number of plans of each step that the peer makes too.
COMPARED = 4


def senses(scene: DrawnScene) -> SceneObservations:
    """Return source estimates with an error of about a cell, and true windows."""
    lattice = torch.from_numpy(scene.grid.lattice).long()
    where = relative_locations(lattice, torch.from_numpy(np.asarray(scene.sources)).long())
    generator = torch.Generator().manual_seed(0)
    sound = where + 0.7 * torch.randn(where.shape, generator=generator)
    windows = torch.from_numpy(window_cells(scene.grid) >= 0).float()
    return SceneObservations({"source_estimate": sound[:, :, None, None]}, {"local_patch": windows})


def peer_graph(cost: np.ndarray, walls: np.ndarray, turn: float) -> nx.DiGraph:
    """Build the partial graph of one episode for networkx: nodes (column, row, heading)."""
    size, graph = len(cost), nx.DiGraph()
    for x, y, h in np.ndindex(size, size, 4):
        for after in ((h - 1) % 4, (h + 1) % 4):
            graph.add_edge((x, y, h), (x, y, after), weight=turn)
        u, v = x + STEPS[h][0], y + STEPS[h][1]
        inside = 0 <= u < size and 0 <= v < size
        if inside and np.isfinite(cost[v, u]) and not walls[y, x] >> h & 1:
            graph.add_edge((x, y, h), (u, v, h), weight=float(cost[v, u]))
    return graph


class Timed:
    """Wrapper of the planner's search that times it, and the peers on some of the same plans."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.peer_seconds = {"networkx": 0.0, "scipy": 0.0}
        self.plans = self.peer_plans = 0

    def __call__(self, cost, walls, pose, target, fallback, turn, back, active, reach):
        """See `avn.planning.shortest_path.first_actions`."""
        start = time.perf_counter()
        found = shortest_path.first_actions(
            cost, walls, pose, target, fallback, turn, back, active, reach
        )
        self.seconds += time.perf_counter() - start
        self.plans += int(active.sum())
        for n in np.flatnonzero(active)[:COMPARED]:
            self._compare(cost[n], walls[n], pose[n], target[n], turn, reach, found[1][n])
        return found

    def _compare(self, cost, walls, pose, target, turn, reach, length) -> None:
        graph = peer_graph(cost, walls, turn)
        goal = "goal"
        for x in range(target[0] - reach, target[0] + reach + 1):
            for y in range(target[1] - reach, target[1] + reach + 1):
                for h in range(4):
                    if (x, y, h) in graph:
                        graph.add_edge((x, y, h), goal, weight=0.0)
        start = time.perf_counter()
        try:
            best, _ = nx.bidirectional_dijkstra(graph, tuple(int(v) for v in pose), goal)
        except nx.NetworkXNoPath:
            return
        self.peer_seconds["networkx"] += time.perf_counter() - start
        self.peer_plans += 1
        assert abs(best - length) < 1e-3, (best, length)
        graph.remove_node(goal)  # scipy takes edges of cost 0 for missing ones
        nodes = {node: number for number, node in enumerate(graph)}
        matrix = csr_array(nx.to_scipy_sparse_array(graph, list(nodes), format="csr"))
        ends = [
            number
            for (x, y, _), number in nodes.items()
            if max(abs(x - target[0]), abs(y - target[1])) <= reach
        ]
        start = time.perf_counter()
        costs = dijkstra(matrix, indices=nodes[tuple(int(v) for v in pose)])
        self.peer_seconds["scipy"] += time.perf_counter() - start
        assert abs(costs[ends].min() - length) < 1e-3, (costs[ends].min(), length)


def main() -> None:
    """Print both rates, their ratio, and what 1,500 episodes take."""
    torch.set_num_threads(1)
    scene = draw("flat", FLAT)
    observed = senses(scene)
    episodes = exhaustive_episodes(scene, ["ring"], VAR, seed=0)
    agent, labels = PlannerAgent(OccupancyMapper(41)), Labels("plan_noexp", "resonance")
    rollout_scene(agent, scene, episodes, VAR, labels, observed)  # compiles
    planner_agent.first_actions = timed = Timed()
    rollout_scene(agent, scene, episodes, VAR, labels, observed)
    planner_agent.first_actions = shortest_path.first_actions
    own = timed.plans / timed.seconds
    print(f"planner, one thread: {own:,.0f} plans a second ({timed.plans:,} plans)")
    for name, seconds in timed.peer_seconds.items():
        peer = timed.peer_plans / seconds
        print(
            f"{name}, one thread: {peer:,.0f} plans a second ({timed.peer_plans:,} plans, same "
            f"costs); the planner makes {own / peer:.0f} times as many"
        )
    agent = PlannerAgent(OccupancyMapper())
    start = time.perf_counter()
    frame = rollout_scene(agent, scene, episodes, VAR, labels, observed)
    summarise(frame)
    seconds = (time.perf_counter() - start) * 1500 / len(frame)
    print(f"1,500 episodes of plan_noexp with figures: {seconds:.1f} s, one thread")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory: {peak:.0f} MB")


if __name__ == "__main__":
    main()
