"""Speed of the batched simulator against one episode after another in plain Python.

In both a greedy agent walks the same episodes and hears the same realisations, and they must end
with the same success, path and position. The peer keeps its tables in lists, which are the fastest
in plain Python. Once with the frozen list of a room, once with every start; then whole rows of the
table.

    python benchmarks/walking.py
"""

from __future__ import annotations

import resource
import time
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from avn.agents.greedy import Greedy
from avn.agents.oracle import Oracle
from avn.agents.random_walk import RandomWalk
from avn.agents.rollout import Labels, rollout, rollout_scene
from avn.core.actions import BACKWARD, FORWARD, ROTATE_LEFT, ROTATE_RIGHT, transitions
from avn.core.random import scramble
from avn.navigation.distances import measure
from avn.navigation.episodes import Episodes, exhaustive_episodes, frozen_episodes
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator
from avn.reporting.results import summarise

SOUNDS = ("ring", "alarm", "clock")
VAR = Protocol("var", "box", False, "moves", max_moves_ratio=2.0)
TAKES = 4
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


@dataclass
class SceneBatch:
    """Tables of the peer, as lists."""

    table: list[list[int]]
    lattice: list[list[int]]
    goal: list[list[bool]]
    source_moves: list[list[int]]
    hearing: list


class PlainEpisode:
    """One episode under `var` in plain Python: the same rules and the same observations."""

    def __init__(
        self, tables: SceneBatch, start: int, source: int, sound: int, realisations: list[int]
    ):
        self.tables, self.start, self.source, self.sound = tables, start, source, sound
        self.realisations = realisations
        self.state, self.attempted, self.actions = start, 0, 0
        self.collided = self.success = self.done = False
        self.limit = 2 * tables.source_moves[source][start // 4]
        self.origin = tables.lattice[start // 4]
        self.right = ((1, 0), (0, -1), (-1, 0), (0, 1))[start % 4]
        self.front = ((0, 1), (1, 0), (0, -1), (-1, 0))[start % 4]

    def step(self, action: int) -> dict:
        """Execute one action and return the observation."""
        after = self.tables.table[self.state][action]
        moving = action <= BACKWARD
        self.collided = moving and after == self.state
        self.state = after
        self.actions += 1
        self.attempted += moving
        self.success = self.tables.goal[self.source][after // 4]
        self.done = self.success or self.attempted >= self.limit or self.actions >= VAR.max_actions
        return self.observe()

    def observe(self) -> dict:
        """Return the agent's observation."""
        x, y = self.tables.lattice[self.state // 4]
        dx, dy = x - self.origin[0], y - self.origin[1]
        realisation = self.realisations[self.actions]
        return {
            "collided": self.collided,
            "odometry": (
                dx * self.right[0] + dy * self.right[1],
                dx * self.front[0] + dy * self.front[1],
                (self.state - self.start) % 4,
            ),
            "source_estimate": self.tables.hearing[self.source][self.state][self.sound][
                realisation
            ],
        }


class PlainGreedy:
    """`avn.agents.greedy.Greedy` for one episode."""

    def __init__(self, patience: int = 4):
        self.patience, self.turns = patience, 0

    def act(self, observation: dict) -> int:
        """Choose one action."""
        right, front = observation["source_estimate"]
        if (front > 0 and front >= abs(right)) or self.turns >= self.patience:
            self.turns = 0
            return FORWARD
        self.turns += 1
        return ROTATE_LEFT if right < 0 else ROTATE_RIGHT


def plain_walk(
    tables: SceneBatch, calls: list[tuple[int, int, int]], realisations: list[list[int]]
) -> list:
    """One episode after another."""
    ended = []
    for call, own in zip(calls, realisations, strict=True):
        episode, agent = PlainEpisode(tables, *call, own), PlainGreedy()
        observation = episode.observe()
        while not episode.done:
            observation = episode.step(agent.act(observation))
        ended.append(episode)
    return ended


def compare(scene: DrawnScene, episodes: Episodes) -> None:
    """Measure both on the same episodes, see that they agree, and print."""
    hearing = made_up_hearing(scene)
    simulator = Simulator(scene, episodes, VAR, SceneObservations({"source_estimate": hearing}))
    rollout(Greedy(), simulator)
    begin = time.perf_counter()
    rollout(Greedy(), simulator)
    batched = time.perf_counter() - begin

    distances = measure(scene, VAR)
    tables = SceneBatch(
        transitions(scene.grid.neighbours).tolist(),
        scene.grid.lattice.tolist(),
        distances.goal.tolist(),
        distances.source_moves.tolist(),
        hearing.tolist(),
    )
    steps = np.arange(VAR.max_actions + 1)
    realisations = (scramble(episodes.keys()[:, None], steps) % np.uint64(TAKES)).tolist()
    columns = (episodes.start.tolist(), episodes.source.tolist(), episodes.sound.tolist())
    calls = list(zip(*columns, strict=True))
    begin = time.perf_counter()
    ended = plain_walk(tables, calls, realisations)
    plain = time.perf_counter() - begin
    for name in ("state", "attempted", "actions", "success"):
        assert getattr(simulator, name).tolist() == [getattr(own, name) for own in ended], name
    total = int(simulator.actions.sum())
    print(f"{len(episodes)} episodes of greedy, {total} steps, the same results in both")
    print(f"  batched {total / batched:12,.0f} steps/s")
    print(f"  plain   {total / plain:12,.0f} steps/s")
    print(f"  ratio   {plain / batched:12.1f}")


def made_up_hearing(scene: DrawnScene) -> Tensor:
    """Return the true locations with an error of 2 m, (K, S, sounds, realisations, 2)."""
    centres = torch.from_numpy(scene.grid.centres).float()
    offset = centres[torch.from_numpy(scene.sources).long()][:, None] - centres
    east, north = offset.unbind(dim=-1)
    right = torch.stack((east, -north, -east, north), dim=-1)
    front = torch.stack((north, east, -north, -east), dim=-1)
    true = torch.stack((right, front), dim=-1).flatten(1, 2)[:, :, None, None]
    shape = (*true.shape[:2], len(SOUNDS), TAKES, 2)
    return true + 2.0 * torch.randn(shape, generator=torch.Generator().manual_seed(0))


def rows(scenes: list[DrawnScene]) -> None:
    """Measure the time of a row of the table: five rooms, three sounds, 1,500 episodes."""
    for name, agent in (("random_walk", RandomWalk()), ("greedy", Greedy()), ("oracle", Oracle())):
        begin = time.perf_counter()
        frames = []
        for scene in scenes:
            episodes = frozen_episodes(scene, SOUNDS, VAR, seed=0)
            hearing = made_up_hearing(scene)
            labels = Labels(name, "resonance")
            frames.append(
                rollout_scene(
                    agent,
                    scene,
                    episodes,
                    VAR,
                    labels,
                    SceneObservations({"source_estimate": hearing}),
                )
            )
        frame = pd.concat(frames)
        summarise(frame)
        seconds = time.perf_counter() - begin
        print(f"{name:12s} {len(frame)} episodes with their figures in {seconds:.2f} s")


def main() -> None:
    """Measure and print."""
    torch.set_num_threads(1)
    scene = draw("flat", FLAT)
    compare(scene, frozen_episodes(scene, SOUNDS, VAR, seed=0))
    compare(scene, exhaustive_episodes(scene, SOUNDS, VAR, seed=0))
    rows([draw(f"flat_{number}", FLAT) for number in range(1, 6)])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory {peak:.0f} MiB, torch and pandas included")


if __name__ == "__main__":
    main()
