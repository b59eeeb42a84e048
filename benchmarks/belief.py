"""Speed of the posterior of `belief`, beside the plain planner's belief and beside scipy.

500 episodes of a hand-drawn flat on a map of 101 x 101 squares, in one batch. Each step of the row
`belief`, with its settings, maps, hears, scores every square and plans; each step of the plain
planner maps, filters its estimates and plans in the same episodes. The update of the posterior
(hearing, and scoring every square) is also timed alone. The lengths of the fields are compared with
those of the compiled Dijkstra search of scipy on the same graphs, which knows no direction and is
called once a field.

    python benchmarks/belief.py
"""

from __future__ import annotations

import resource
import time

import numpy as np
import torch
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from avn.acoustics.settings import AcousticsConfig
from avn.agents.belief_agent import BeliefAgent
from avn.agents.planner_agent import PlannerAgent
from avn.agents.rollout import Labels, rollout_scene
from avn.apartments.local_patch import window_cells
from avn.config.python import compose_command
from avn.core.heard import bearing_label
from avn.core.settings import plain
from avn.dataset.source_locations import relative_locations
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.navigation.episodes import frozen_episodes
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.planning.settings import ArrivalModel
from avn.planning.sound_fields import DIAGONAL, STRAIGHT, UNREACHED, SoundFields

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
EPISODES, SIZE, BINS = 500, 101, 72
REGIME = AcousticsConfig("diffraction", "diffraction")


def observed(scene: DrawnScene) -> SceneObservations:
    """Return noisy directions and lengths, noisy estimates, and true local patches."""
    random = torch.Generator().manual_seed(0)
    lattice = torch.from_numpy(scene.grid.lattice).long()
    where = relative_locations(lattice, torch.from_numpy(np.asarray(scene.sources)).long())
    estimate = where + 0.7 * torch.randn(where.shape, generator=random)
    length = torch.linalg.vector_norm(estimate, dim=-1, keepdim=True).clamp_min(0.3).log()
    unit = torch.nn.functional.normalize(estimate, dim=-1)
    bearing = bearing_label(unit.flatten(0, 1), BINS, 0.3).clamp_min(1e-9).log()
    rest = torch.full((*length.shape[:2], 3), 0.3)
    parts = (bearing.unflatten(0, where.shape[:2]), length, rest[..., :2], estimate, rest[..., :1])
    arrival = torch.cat(parts, -1)[:, :, None, None]
    patches = torch.from_numpy(window_cells(scene.grid) >= 0).float()
    audio = {"source_estimate": estimate[:, :, None, None], "arrival": arrival}
    return SceneObservations(audio, {"local_patch": patches})


class TimedBelief(BeliefAgent):
    """Agent of the row `belief` that times the updates of its posterior."""

    def reset(self, n, generator, protocol) -> None:
        """Begin N new episodes, and forget the times."""
        super().reset(n, generator, protocol)
        self.seconds: list[float] = []

    def _update_source(self, observation, active) -> None:
        start = time.perf_counter()
        super()._update_source(observation, active)
        self.seconds.append(time.perf_counter() - start)


def row_belief() -> TimedBelief:
    """Return the agent of the row `belief` on true local patches."""
    cfg, _ = compose_command("eval", ["agent=belief", "acoustics=diffraction"])
    settings = plain(cfg, "planner")
    model = ArrivalModel(**settings.pop("model"))
    own = {key: value for key, value in settings.items() if key not in ("_target_", "name")}
    return TimedBelief(OccupancyMapper(SIZE), model, **own)


def steps_a_second(agent: PlannerAgent, scene: DrawnScene, seen: SceneObservations) -> float:
    """Return the steps of the whole batch that an agent takes in a second."""
    protocol = Protocol("stop", "radius", True, "metres", num_starts=100, max_actions=100)
    episodes = frozen_episodes(scene, ["ring"], protocol, seed=0)
    assert len(episodes) == EPISODES
    labels = Labels("agent", REGIME.name)
    seconds: list[float] = []
    for _ in range(2):  # the first one compiles
        taken = 0

        def count(simulator, agent, observation, actions) -> bool:
            nonlocal taken
            taken += actions is not None and not bool(simulator.done.all())
            return taken >= 60

        start = time.perf_counter()
        rollout_scene(agent, scene, episodes, protocol, labels, seen, count)
        seconds.append(time.perf_counter() - start)
    return taken / seconds[-1]


def fields_a_second(scene: DrawnScene) -> tuple[float, float, float]:
    """Return the fields in a second: new ones, repaired ones, and new ones of scipy.

    The lengths of the new ones are equal. One square is blocked for the repaired ones.
    """
    cost = np.full((1, SIZE, SIZE), np.inf, dtype=np.float32)
    column, row = (scene.grid.lattice + 30).T
    cost[0, row, column] = 1
    places = np.stack((column, row), 1)[None, :40].astype(np.int64)
    count = places.shape[1]
    fields, every = SoundFields(1, count, SIZE, 100, BINS), np.ones((1, count), dtype=np.bool_)
    zeros, slots = np.zeros(count, dtype=np.int64), np.arange(count)
    own = repaired = peer = 0.0
    graph, changed = peer_graph(cost[0]), cost.copy()
    changed[0, row[-1], column[-1]] = np.inf
    for _ in range(20):  # the fastest, for others may use the cores
        fields.forget(zeros, slots)
        start = time.perf_counter()
        fields.update(cost, places, every, every[:, 0])
        own = max(own, count / (time.perf_counter() - start))
        length = fields.length.copy()
        start = time.perf_counter()
        fields.update(changed, places, every, every[:, 0])
        repaired = max(repaired, count / (time.perf_counter() - start))
        start = time.perf_counter()
        found = [dijkstra(graph, indices=y * SIZE + x) for x, y in places[0]]
        peer = max(peer, count / (time.perf_counter() - start))
    expected = np.where(np.isfinite(found), found, UNREACHED).reshape(count, SIZE, SIZE)
    np.testing.assert_array_equal(length[0], expected)
    return own, repaired, peer


def peer_graph(cost: np.ndarray) -> coo_array:
    """Return the graph of a field for scipy: eight neighbours, no step between two blocked ones."""
    ends, weights = [], []
    free = np.isfinite(cost)
    for y, x in np.argwhere(free):
        for v in range(y - 1, y + 2):
            for u in range(x - 1, x + 2):
                diagonal = u != x and v != y
                if (u, v) == (x, y) or not free[v, u]:
                    continue
                if diagonal and not (free[v, x] or free[y, u]):
                    continue
                ends.append((y * SIZE + x, v * SIZE + u))
                weights.append(DIAGONAL if diagonal else STRAIGHT)
    return coo_array((weights, np.transpose(ends)), shape=(SIZE**2, SIZE**2)).tocsr()


def main() -> None:
    """Print the rates, their ratios and the peak memory."""
    scene = draw("flat", FLAT)
    seen = observed(scene)
    agent = row_belief()
    belief = steps_a_second(agent, scene, seen)
    updates = len(agent.seconds) / sum(agent.seconds)
    planner = steps_a_second(
        PlannerAgent(OccupancyMapper(SIZE), source_filter="bayes"), scene, seen_with_stop(seen)
    )
    print(
        f"belief, {EPISODES} episodes, evidence of {agent.model.places} squares: {belief:.1f} "
        f"steps of the batch a second; the posterior alone {updates:.1f} updates a second"
    )
    print(f"plain planner, the same episodes: {planner:.1f}; belief takes {planner / belief:.1f} x")
    own, repaired, peer = fields_a_second(scene)
    print(
        f"fields: {own:,.0f} a second with directions; scipy, lengths alone: {peer:,.0f} (same "
        f"lengths); own are {own / peer:.1f} times as many"
    )
    print(f"fields repaired where one square was blocked: {repaired:,.0f} a second")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory: {peak:.0f} MB")


def seen_with_stop(seen: SceneObservations) -> SceneObservations:
    """Return observations with the probability of Stop, which the plain planner needs: 0."""
    never = torch.zeros(seen.audio["arrival"].shape[:4])
    return SceneObservations({**seen.audio, "stop_probability": never}, seen.visual)


if __name__ == "__main__":
    main()
