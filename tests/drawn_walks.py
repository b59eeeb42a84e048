"""Traces of real agents with true senses in a drawn apartment, for tests of pictures and films."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from heard_places import heard
from torch import Tensor

from avn.agents.base import Agent
from avn.agents.belief_agent import BeliefAgent
from avn.agents.planner_agent import PlannerAgent
from avn.agents.recorder import Recorder
from avn.agents.rollout import Labels, records, rollout
from avn.apartments.local_patch import window_cells
from avn.dataset.source_locations import relative_locations
from avn.mapping.memory_mapper import MemoryMapper
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.navigation.episodes import frozen_episodes
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator
from avn.navigation.trace import Trace

FLAT = """
aaaaaaa#bbbbbbbb
aaaaaaa#bbbbbbbb
aaaa#####bbbbbbb
aaaa#aa#bbbbbBbb
aaaaaaa#bbbbbbbb
aaaaaaaabbbbbbbb
aaaaaaa#bbbbbbbb
"""
VAR = Protocol(
    "var", "box", False, "moves", max_moves_ratio=2.0, num_starts=6, exploration_steps=60
)
TAKES = 3


def flat() -> DrawnScene:
    return draw("flat", FLAT)


def simulator(scene: DrawnScene, source_estimates: Tensor | None = None) -> Simulator:
    """Six episodes in which the agent sees true windows.

    It hears the very place of the source, unless `source_estimates` says otherwise.
    """
    lattice = torch.from_numpy(scene.grid.lattice).long()
    sources = torch.from_numpy(np.asarray(scene.sources)).long()
    where = relative_locations(lattice, sources)[:, :, None, None].expand(-1, -1, 1, TAKES, -1)
    visual = {
        "local_patch": torch.from_numpy(window_cells(scene.grid) >= 0).float(),
        "visual_embedding": torch.eye(4 * scene.grid.cells),  # every state looks like itself alone
    }
    observed = SceneObservations(
        {
            "source_estimate": where if source_estimates is None else source_estimates,
            "arrival": heard(scene).expand(-1, -1, 1, TAKES, -1),
        },
        visual,
    )
    return Simulator(scene, frozen_episodes(scene, ["ring"], VAR, 0), VAR, observed)


def ours(explores: bool = False, localisation: str = "retrieval+odometry") -> PlannerAgent:
    mapper = MemoryMapper(41, localisation=localisation) if explores else OccupancyMapper(41)
    return PlannerAgent(mapper)


def hearing() -> BeliefAgent:
    """Return an agent with a posterior of the source."""
    return BeliefAgent(OccupancyMapper(41), obstacle_threshold=0.01)


def walked(agent: Agent, rows: Sequence[int] = tuple(range(6))) -> list[Trace]:
    """Traces of an agent's episodes in the flat."""
    world = simulator(flat())
    recorder = Recorder({"flat": rows}, TAKES, beliefs=True)
    rollout(agent, world, recorder)
    found = records(world, Labels("ours", "resonance")).to_dict("records")
    return [recorder.trace("flat", row, found[row]) for row in rows]


def clips(trace: Trace) -> Tensor:
    """A tone for each step that is louder on the right."""
    time = torch.arange(16000) / 16000
    steps = torch.arange(len(trace.state))[:, None]
    tone = torch.sin(2 * torch.pi * (400 + 100 * (steps % 4)) * time)
    return torch.stack((0.2 * tone, 0.8 * tone), dim=1)


def views(trace: Trace) -> np.ndarray:
    """A picture of one colour for each heading."""
    colours = np.array([(200, 0, 0), (0, 200, 0), (0, 0, 200), (200, 200, 0)], dtype=np.uint8)
    return np.tile(colours[trace.state % 4][:, None, None], (1, 16, 16, 1))
