"""Agents that walk in the heard direction, with exact senses and with made-up ones."""

import math

import numpy as np
import pytest
import torch
from heard_places import BINS, SIZE, arrival, first_action, heard, observation, run
from small_places import FLAT, STOP, VAR

from avn.agents.direction_follower import DirectionFollower
from avn.core.actions import FORWARD, ROTATE_LEFT, ROTATE_RIGHT
from avn.core.actions import STOP as STOPS
from avn.core.errors import UserError
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.navigation.navigation_scene import draw

HALL = "\n".join(["a" * 15] * 7 + ["a" * 7 + "A" + "a" * 7] + ["a" * 15] * 7)


def follower(**settings):
    return DirectionFollower(OccupancyMapper(SIZE), obstacle_threshold=0.01, **settings)


@pytest.mark.parametrize("heading", range(4))
def test_it_turns_to_what_it_hears(heading):
    heard = arrival([0, 90, 270, 10, 350])
    found = first_action(follower(), VAR, heard, (0, 0, heading)).tolist()
    assert found == [FORWARD, ROTATE_RIGHT, ROTATE_LEFT, FORWARD, FORWARD]


@pytest.mark.parametrize(("degrees", "square"), [(0, (0, 6)), (90, (6, 0)), (225, (-4, -4))])
@pytest.mark.parametrize("heading", [0, 1])
def test_the_target_lies_ahead_in_the_heard_direction(degrees, square, heading):
    agent = follower(ahead=3.0)
    first_action(agent, STOP, arrival([degrees - 90 * heading]), (0, 0, heading))
    target = agent._targets(np.array([True]))[0] - SIZE // 2
    assert np.array_equal(target, square)


def test_in_an_empty_hall_it_walks_straight_to_the_source():
    frame = run(follower(), VAR, heard(draw("hall", HALL)), HALL)
    assert frame["success"].all()
    assert frame["spl"].mean() > 0.9


def test_around_corners_exact_directions_suffice():
    frame = run(follower(stop_within=0.6), STOP)
    assert frame["success"].mean() > 0.95
    assert frame["spl"].mean() > 0.85


def test_noise_does_not_lead_to_the_source():
    scene = draw("flat", FLAT)
    nothing = torch.zeros_like(heard(scene))
    nothing[..., :BINS] = torch.randn(nothing[..., :BINS].shape, generator=torch.manual_seed(0))
    assert run(follower(), VAR, nothing)["success"].mean() < 0.7


def test_it_stops_where_the_heard_length_is_surely_short():
    near, far = arrival([0], 0.5), arrival([0], 2.0)
    unsure = arrival([0], 0.7, sigma=1.0)
    heard = torch.cat((near, far, unsure))
    agent = follower(stop_within=0.9, stop_above=0.8)
    assert (first_action(agent, STOP, heard) == STOPS).tolist() == [True, False, False]
    assert not (first_action(agent, VAR, heard) == STOPS).any()


def test_the_probability_that_stop_needs_halves():
    """It hears a length of 1.5 m with a standard deviation of 0.5: it is below 0.9 m with 0.15."""
    share = torch.special.ndtr(torch.tensor(math.log(0.9 / 1.5) / 0.5)).item()
    agent = follower(stop_within=0.9, stop_above=0.8, stop_half_life=5)
    agent.reset(1, torch.Generator(), STOP)
    for step in range(1, 100):
        heard = observation(arrival([0], 1.5, sigma=0.5), (0, step, 0))
        if int(agent.act(heard)) == STOPS:
            break
    assert step == math.ceil(5 * math.log2(0.8 / share))


def test_it_stops_where_it_is_once_the_sound_has_ended():
    """It hears for three actions, and hears nothing after them or from the beginning."""
    silence = arrival([0])
    silence[:, :BINS] = -math.log(BINS)
    for heard_before, protocol, last in ((3, STOP, 8), (0, STOP, 40), (3, VAR, 40)):
        agent = follower(least_information=0.08, silent_after=5)
        agent.reset(1, torch.Generator(), protocol)
        for step in range(1, 41):
            heard = arrival([0]) if step <= heard_before else silence
            if int(agent.act(observation(heard, (0, 0, 0)))) == STOPS:
                break
        assert step == last


def test_a_place_where_directions_contradict_each_other_is_left():
    agent = follower(max_rotations=2)
    agent.reset(1, torch.Generator(), VAR)
    headings, actions = [0], []
    for _ in range(8):
        action = int(agent.act(observation(arrival([180]), (0, 0, headings[-1]))))
        actions.append(action)
        headings.append((headings[-1] + {ROTATE_LEFT: 3, ROTATE_RIGHT: 1}.get(action, 0)) % 4)
    assert FORWARD in actions


def test_settings_out_of_range_or_without_effect_are_named():
    unused = {"source_filter", "error", "stop_within", "stop_half_life", "silent_after"}
    assert unused <= set(follower().unused_settings(VAR))
    assert "stop_within" not in follower().unused_settings(STOP)
    assert "stop_probability" not in follower().wants(STOP)
    for key, value in (
        ("ahead", 0.5),
        ("stop_within", 0),
        ("stop_above", 1),
        ("stop_half_life", 0),
        ("silent_after", 0),
    ):
        with pytest.raises(UserError, match=rf"planner\.{key}: {value}"):
            follower(**{key: value})
