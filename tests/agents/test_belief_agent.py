"""An agent that hears around corners in two rooms, with exact senses."""

import dataclasses
import math

import numpy as np
import pandas as pd
import pytest
import torch
from small_places import FLAT, STOP, VAR
from torch import Tensor

from avn.agents.belief_agent import BeliefAgent, goal_offsets
from avn.agents.rollout import Labels, rollout_scene
from avn.apartments.local_patch import window_cells
from avn.core.errors import UserError
from avn.core.heard import bearing_label
from avn.dataset.source_locations import to_headings
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.navigation.episodes import exhaustive_episodes
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.planning.settings import ArrivalModel
from avn.planning.sound_fields import SQUARES, sound_fields

BINS = 72
SIZE = 35  # squares of the map, enough from every start


def heard(scene: DrawnScene) -> Tensor:
    """Exact direction and length of the path of sound from every state, (K, S, 1, 1, B + 6)."""
    lattice = scene.grid.lattice.astype(np.int64)
    cells, size = len(lattice), int(lattice.max()) + 1
    cost = np.full((1, size, size), np.inf, np.float32)
    cost[0, lattice[:, 1], lattice[:, 0]] = 1
    fields = np.empty((1, cells, size, size), np.int16), np.empty((1, cells, size, size), np.uint8)
    every = np.arange(cells)
    sound_fields(cost, lattice[None], np.zeros(cells, np.int64), every, 500, BINS, *fields)
    found = []
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
        other = torch.zeros(len(label), 4)
        found.append(torch.cat((label, length, torch.full_like(length, 0.1), other), 1))
    return torch.stack(found)[:, :, None, None]


def run(agent: BeliefAgent, protocol: Protocol, arrival: Tensor | None = None) -> pd.DataFrame:
    scene = draw("flat", FLAT)
    audio = {"arrival": heard(scene) if arrival is None else arrival}
    goal = torch.from_numpy(protocol.goal_cells(scene.grid, np.asarray(scene.sources)))
    audio["stop_probability"] = goal.repeat_interleave(4, dim=1)[:, :, None, None].float()
    seen = {"local_patch": torch.from_numpy(window_cells(scene.grid) >= 0).float()}
    episodes = exhaustive_episodes(scene, ["ring"], protocol, seed=0)
    observations = SceneObservations(audio, seen)
    labels = Labels("belief", "diffraction")
    return rollout_scene(agent, scene, episodes, protocol, labels, observations)


@pytest.mark.parametrize("protocol", [VAR, STOP], ids=["var", "stop"])
@pytest.mark.parametrize("look", ["once", "around"])
def test_with_true_senses_it_arrives_by_nearly_shortest_paths(protocol: Protocol, look: str):
    frame = run(BeliefAgent(OccupancyMapper(SIZE), look=look, obstacle_threshold=0.01), protocol)
    assert frame["success"].mean() > 0.97
    assert frame["spl"].mean() > 0.9


def test_directions_alone_lead_to_the_source():
    model = ArrivalModel(distance_weight=0)
    frame = run(BeliefAgent(OccupancyMapper(SIZE), model=model, obstacle_threshold=0.01), VAR)
    assert frame["success"].mean() > 0.95


def test_an_agent_that_hears_nothing_arrives_less_often():
    scene = draw("flat", FLAT)
    nothing = torch.zeros_like(heard(scene))
    nothing[..., :BINS] = -math.log(BINS)
    nothing[..., BINS + 1] = 10.0
    frame = run(BeliefAgent(OccupancyMapper(SIZE), obstacle_threshold=0.01), VAR, nothing)
    assert frame["success"].mean() < 0.7


def test_the_classifier_can_decide_to_stop():
    agent = BeliefAgent(OccupancyMapper(SIZE), stop_by="classifier", obstacle_threshold=0.01)
    assert "stop_probability" in agent.wants(STOP)
    assert "stop_probability" not in agent.wants(VAR)
    assert run(agent, STOP)["success"].mean() > 0.97


def test_it_hears_all_headings_before_it_stops():
    # one heading in four always claims that the source is here
    scene = draw("flat", FLAT)
    arrival = heard(scene)
    arrival[:, ::4, ..., BINS] = math.log(0.25)
    outcomes = []
    for confirm in (False, True):
        agent = BeliefAgent(OccupancyMapper(SIZE), confirm=confirm, obstacle_threshold=0.01)
        frame = run(agent, STOP, arrival)
        outcomes.append((frame["outcome"] == "stopped_elsewhere").mean())
        turns = frame["actions"] - frame["path_length"] / 0.5
        if confirm:
            assert turns[frame["success"] == 1].min() >= 4, "three turns and Stop"
    assert outcomes[1] < 0.5 * outcomes[0]


def test_equal_runs_have_equal_records():
    frames = [
        run(BeliefAgent(OccupancyMapper(SIZE), obstacle_threshold=0.01), STOP) for _ in range(2)
    ]
    pd.testing.assert_frame_equal(*frames)


def test_settings_without_effect_are_named():
    agent = BeliefAgent(OccupancyMapper(SIZE))
    assert {"source_filter", "error", "stop_by"} <= set(agent.unused_settings(VAR))
    assert {"confirm", "stop_above"} <= set(agent.unused_settings(VAR))
    assert not {"stop_by", "confirm"} & set(agent.unused_settings(STOP))
    other = BeliefAgent(OccupancyMapper(SIZE), stop_by="classifier")
    assert "stop_above" in other.unused_settings(STOP)
    assert dataclasses.asdict(agent.model) == dataclasses.asdict(ArrivalModel())
    with pytest.raises(UserError, match=r"planner\.stop_by: 'luck'"):
        BeliefAgent(OccupancyMapper(SIZE), stop_by="luck")
    with pytest.raises(UserError, match=r"planner\.stop_above: 0"):
        BeliefAgent(OccupancyMapper(SIZE), stop_above=0)


def test_the_goal_is_that_of_the_protocol():
    beside = {(0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)}
    assert set(map(tuple, goal_offsets(STOP).tolist())) == beside
    assert len(goal_offsets(VAR)) == 9
    assert len(goal_offsets(dataclasses.replace(STOP, radius=1.5))) == 13
