"""Exact arrivals of sound in apartments drawn by hand, and runs of agents that hear them."""

import dataclasses
import math

import numpy as np
import pandas as pd
import torch
from small_places import FLAT
from tensordict import TensorDict
from torch import Tensor

from avn.agents.planner_agent import PlannerAgent
from avn.agents.rollout import Labels, rollout_scene
from avn.apartments.local_patch import window_cells
from avn.core.heard import bearing_label
from avn.dataset.source_locations import locate_sources, to_headings
from avn.navigation.episodes import Episodes, exhaustive_episodes
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.planning.sound_fields import SQUARES, sound_fields

BINS = 72
SIZE = 35  # squares of the map, enough from every start


def heard(scene: DrawnScene) -> Tensor:
    """Exact arrival of the sound of each source at every state, (K, S, 1, 1, B + 6)."""
    lattice = scene.grid.lattice.astype(np.int64)
    cells, size = len(lattice), int(lattice.max()) + 1
    cost = np.full((1, size, size), np.inf, np.float32)
    cost[0, lattice[:, 1], lattice[:, 0]] = 1
    fields = np.empty((1, cells, size, size), np.int16), np.empty((1, cells, size, size), np.uint8)
    every = np.arange(cells)
    sound_fields(cost, lattice[None], np.zeros(cells, np.int64), every, 500, BINS, *fields)
    locations, in_sight = locate_sources(scene)
    found: list[Tensor] = []
    for source in scene.sources:
        x, y = lattice[source]
        units, bins = fields[0][0, :, y, x], fields[1][0, :, y, x]
        angle = torch.from_numpy(bins * (2 * math.pi / BINS))
        there = torch.from_numpy(bins < BINS)
        east, north = (torch.where(there, own, 0.0) for own in (angle.sin(), angle.cos()))
        direction = to_headings(east[None].float(), north[None].float())[0]
        label = bearing_label(direction, BINS, 2 * math.pi / BINS).clamp_min(1e-9).log()
        metres = np.maximum(units * SQUARES * 0.5, 0.25)
        length = torch.from_numpy(np.log(metres)).float().repeat_interleave(4)[:, None]
        sight = torch.where(in_sight[len(found)], 10.0, -10.0)[:, None]
        place = locations[len(found)]
        other = torch.cat((sight, place, torch.full_like(length, 0.1)), 1)
        found.append(torch.cat((label, length, torch.full_like(length, 0.1), other), 1))
    return torch.stack(found)[:, :, None, None]


def third_of_starts(scene: DrawnScene, protocol: Protocol) -> Episodes:
    """A third of all starts, of all four headings, as 3 and 4 have no common factor."""
    every = exhaustive_episodes(scene, ["ring"], protocol, seed=0)
    names = ("number", "sound", "source", "start", "trajectory_index")
    return dataclasses.replace(every, **{name: getattr(every, name)[::3] for name in names})


def run(
    agent: PlannerAgent, protocol: Protocol, arrival: Tensor | None = None, drawing: str = FLAT
) -> pd.DataFrame:
    """Records of an agent from a third of all starts in a drawn apartment; it sees all ahead."""
    scene = draw("flat", drawing)
    audio = {"arrival": heard(scene) if arrival is None else arrival}
    goal = torch.from_numpy(protocol.goal_cells(scene.grid, np.asarray(scene.sources)))
    audio["stop_probability"] = goal.repeat_interleave(4, dim=1)[:, :, None, None].float()
    seen = {"local_patch": torch.from_numpy(window_cells(scene.grid) >= 0).float()}
    episodes = third_of_starts(scene, protocol)
    observations = SceneObservations(audio, seen)
    labels = Labels("an agent", "diffraction")
    return rollout_scene(agent, scene, episodes, protocol, labels, observations)


def arrival(degrees, metres=5.0, sigma=0.1):
    """What is heard from some directions, clockwise from the front, (N, B + 6)."""
    values = torch.zeros(len(degrees), BINS + 6)
    values[:, :BINS] = -9.0
    bins = (torch.as_tensor(degrees) / 360 * BINS).round().long() % BINS
    values[torch.arange(len(degrees)), bins] = 0.0
    values[:, BINS], values[:, BINS + 1] = math.log(metres), sigma
    return values


def observation(heard, pose, patch=0.9):
    n = len(heard)
    return TensorDict(
        {
            "arrival": heard,
            "odometry": torch.tensor(pose).expand(n, 3).clone(),
            "collided": torch.zeros(n, dtype=torch.bool),
            "local_patch": torch.full((n, 5, 5), patch),
        },
        batch_size=[n],
    )


def first_action(agent, protocol, heard, pose=(0, 0, 0)):
    agent.reset(len(heard), torch.Generator(), protocol)
    return agent.act(observation(heard, pose))
