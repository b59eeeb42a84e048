"""Speed of the planner against networkx, called once for each episode and step.

Both plan on the same partial graphs, those of `ours_noexp` in a hand-drawn flat, and must find
paths of the same cost. The peer has a graph for each episode; its update is not timed, only its
search is. Then whole episodes.

    python benchmarks/planning.py
"""

from __future__ import annotations

import resource
import time

import networkx as nx
import numpy as np
import torch

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
    """Wrapper of the planner's search that times it, and the peer on some of the same plans."""

    def __init__(self) -> None:
        self.seconds = self.peer_seconds = 0.0
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
        self.peer_seconds += time.perf_counter() - start
        self.peer_plans += 1
        assert abs(best - length) < 1e-3, (best, length)


def main() -> None:
    """Print both rates, their ratio, and what 1,500 episodes take."""
    torch.set_num_threads(1)
    scene = draw("flat", FLAT)
    observed = senses(scene)
    episodes = exhaustive_episodes(scene, ["ring"], VAR, seed=0)
    agent, labels = PlannerAgent(OccupancyMapper(41)), Labels("ours_noexp", "resonance")
    rollout_scene(agent, scene, episodes, VAR, labels, observed)  # compiles
    planner_agent.first_actions = timed = Timed()
    rollout_scene(agent, scene, episodes, VAR, labels, observed)
    planner_agent.first_actions = shortest_path.first_actions
    own = timed.plans / timed.seconds
    peer = timed.peer_plans / timed.peer_seconds
    print(f"planner: {own:,.0f} plans a second ({timed.plans:,} plans)")
    print(f"networkx: {peer:,.0f} plans a second ({timed.peer_plans:,} plans, same costs)")
    print(f"ratio: {own / peer:.0f} times")
    agent = PlannerAgent(OccupancyMapper())
    start = time.perf_counter()
    frame = rollout_scene(agent, scene, episodes, VAR, labels, observed)
    summarise(frame)
    seconds = (time.perf_counter() - start) * 1500 / len(frame)
    print(f"1,500 episodes of ours_noexp with figures: {seconds:.1f} s, one thread")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory: {peak:.0f} MB")


if __name__ == "__main__":
    main()
