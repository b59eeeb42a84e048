"""An agent that hears around corners in two rooms, with exact senses."""

import dataclasses
import math
from functools import cache

import numpy as np
import pandas as pd
import pytest
import torch
from heard_places import BINS, SIZE, heard, run
from small_places import FLAT, STOP, VAR

from avn.agents.belief_agent import BeliefAgent, goal_offsets
from avn.core.errors import UserError
from avn.core.heard import bearing_label
from avn.dataset.source_locations import locate_sources
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.protocols import Protocol
from avn.planning.arrival_belief import ArrivalBelief
from avn.planning.settings import ArrivalModel


def run_of(protocol: Protocol, look: str) -> pd.DataFrame:
    return run(BeliefAgent(OccupancyMapper(SIZE), look=look, obstacle_threshold=0.01), protocol)


# Records that several tests look at.
made = cache(run_of)


@pytest.mark.parametrize("protocol", [VAR, STOP], ids=["var", "stop"])
@pytest.mark.parametrize("look", ["once", "around"])
def test_with_true_senses_it_arrives_by_nearly_shortest_paths(protocol: Protocol, look: str):
    frame = made(protocol, look)
    assert frame["success"].mean() > 0.97
    assert frame["spl"].mean() > 0.9


def test_directions_alone_lead_to_the_source():
    model = ArrivalModel(distance_weight=0)
    frame = run(BeliefAgent(OccupancyMapper(SIZE), model=model, obstacle_threshold=0.01), VAR)
    assert frame["success"].mean() > 0.95


def through_walls(scene: DrawnScene) -> torch.Tensor:
    """Exact arrivals in a straight line, (K, S, 1, 1, B + 6)."""
    locations, _ = locate_sources(scene)
    metres = torch.linalg.vector_norm(locations, dim=-1, keepdim=True)
    unit = torch.where(metres > 1e-6, locations / metres.clamp_min(1e-6), 0.0)
    label = bearing_label(unit.flatten(0, 1), BINS, math.tau / BINS).unflatten(0, unit.shape[:2])
    rest = torch.full((*metres.shape[:2], 5), 0.1)
    length = metres.clamp_min(0.25).log()
    return torch.cat((label.clamp_min(1e-9).log(), length, rest), -1)[:, :, None, None]


def test_it_follows_sound_through_walls_where_that_is_how_it_arrives():
    arrival, spl = through_walls(draw("flat", FLAT)), {}
    for direct_path in ("transmission", "diffraction"):
        agent = BeliefAgent(OccupancyMapper(SIZE), direct_path=direct_path, obstacle_threshold=0.01)
        spl[direct_path] = run(agent, STOP, arrival)["spl"].mean()
    assert spl["transmission"] > 0.97
    assert spl["diffraction"] < spl["transmission"] - 0.02


def test_an_agent_that_hears_nothing_arrives_less_often():
    scene = draw("flat", FLAT)
    nothing = torch.zeros_like(heard(scene))
    nothing[..., :BINS] = -math.log(BINS)
    nothing[..., BINS], nothing[..., BINS + 1] = math.log(4.0), 1000.0
    frame = run(BeliefAgent(OccupancyMapper(SIZE), obstacle_threshold=0.01), VAR, nothing)
    assert frame["success"].mean() < 0.5


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
    pd.testing.assert_frame_equal(made(STOP, "once"), run_of(STOP, "once"))


def test_settings_without_effect_are_named():
    agent = BeliefAgent(OccupancyMapper(SIZE))
    assert {"source_filter", "error", "stop_by"} <= set(agent.unused_settings(VAR))
    assert {"confirm", "stop_above"} <= set(agent.unused_settings(VAR))
    assert not {"stop_by", "confirm"} & set(agent.unused_settings(STOP))
    other = BeliefAgent(OccupancyMapper(SIZE), stop_by="classifier")
    assert "stop_above" in other.unused_settings(STOP)
    assert agent.model == ArrivalModel(shared_by_headings=0)
    around = BeliefAgent(OccupancyMapper(SIZE), look="around")
    assert around.model == ArrivalModel(shared_by_headings=1), "all squares have four headings"
    with pytest.raises(UserError, match=r"planner\.stop_by: 'luck'"):
        BeliefAgent(OccupancyMapper(SIZE), stop_by="luck")
    with pytest.raises(UserError, match=r"planner\.stop_above: 0"):
        BeliefAgent(OccupancyMapper(SIZE), stop_above=0)
    with pytest.raises(UserError, match=r"planner\.direct_path: 'bent' is none of diffraction, "):
        BeliefAgent(OccupancyMapper(SIZE), direct_path="bent")
    with pytest.raises(UserError, match=r"planner\.target: 'door'"):
        BeliefAgent(OccupancyMapper(SIZE), target="door")


def test_the_target_is_the_square_from_which_success_is_likeliest():
    # one likely square far off, and a cluster of less likely ones
    belief = ArrivalBelief(1, 9, 8, ArrivalModel())
    belief.log_belief[:] = -math.inf
    belief.log_belief[0, 1, 1] = math.log(0.3)
    for x, y in ((6, 6), (5, 6), (7, 6), (6, 5), (6, 7)):
        belief.log_belief[0, y, x] = math.log(0.14)
    cost, active = np.ones((1, 9, 9), np.float32), np.array([True])
    assert belief.targets(cost, active).tolist() == [[1, 1]]
    assert belief.targets(cost, active, goal_offsets(STOP)).tolist() == [[6, 6]]
    belief.log_belief[0, 6, 6] = -math.inf  # where the source cannot be, it does not walk
    (found,) = belief.targets(cost, active, goal_offsets(STOP)).tolist()
    assert found != [6, 6]


def test_the_goal_is_that_of_the_protocol():
    beside = {(0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)}
    assert set(map(tuple, goal_offsets(STOP).tolist())) == beside
    assert len(goal_offsets(VAR)) == 9
    assert len(goal_offsets(dataclasses.replace(STOP, radius=1.5))) == 13
