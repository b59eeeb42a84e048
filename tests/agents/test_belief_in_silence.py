"""An agent whose sound begins late, ends early, or cannot be located."""

import math

import pytest
import torch
from heard_places import BINS, SIZE, arrival, heard, observation, third_of_starts
from small_places import FLAT, STOP, VAR

from avn.agents.belief_agent import BeliefAgent
from avn.agents.rollout import Labels, rollout_scene
from avn.apartments.local_patch import window_cells
from avn.core.actions import ROTATE_RIGHT
from avn.core.actions import STOP as STOP_ACTION
from avn.core.errors import UserError
from avn.core.heard import Arrivals
from avn.mapping.occupancy_mapper import OccupancyMapper
from avn.navigation.dynamics import Dynamics
from avn.navigation.navigation_scene import draw
from avn.navigation.observations import SceneObservations
from avn.navigation.schedule import Schedule


def nothing(n):
    """What a network makes of noise alone: any direction, a length of the usual size."""
    values = torch.zeros(n, BINS + 6)
    values[:, :BINS] = -math.log(BINS)
    values[:, BINS], values[:, BINS + 1] = math.log(4.0), 0.7
    return values


class Ears:
    """Exact arrivals while the source sounds, and noise otherwise."""

    sounds, realisations, shape = 1, 1, (BINS + 6,)

    def __init__(self, scene):
        self.exact = heard(scene)[:, :, 0, 0]

    def __call__(self, clip, mix=None):
        there = (mix.begin < 1) & (mix.end > 0)
        exact = self.exact[clip.source, clip.state]
        return torch.where(there[:, None], exact, nothing(len(exact)))


def walked(protocol, schedule, **settings):
    """Records of an agent from a third of all starts in a drawn flat."""
    scene = draw("flat", FLAT)
    agent = BeliefAgent(OccupancyMapper(SIZE), obstacle_threshold=0.01, **settings)
    seen = {"local_patch": torch.from_numpy(window_cells(scene.grid) >= 0).float()}
    observations = SceneObservations({}, seen, {"arrival": Ears(scene)})
    episodes = third_of_starts(scene, protocol)
    labels = Labels("an agent", "diffraction")
    dynamics = Dynamics(schedule=schedule)
    return rollout_scene(agent, scene, episodes, protocol, labels, observations, None, dynamics)


def test_the_information_of_a_direction_is_in_nats():
    values = nothing(2)
    values[1] = arrival([30])[0]
    values[1, :BINS] = values[1, :BINS].log_softmax(0)
    found = Arrivals(values).information
    assert float(found[0]) == pytest.approx(0, abs=1e-5)
    assert math.log(BINS) - 0.3 < float(found[1]) < math.log(BINS)
    half = nothing(1)
    half[0, :BINS] = -math.inf
    half[0, : BINS // 2] = -math.log(BINS // 2)
    half[0, BINS // 2 : BINS] = -1e9
    assert float(Arrivals(half).information) == pytest.approx(math.log(2), abs=1e-4)


def test_it_turns_until_it_hears_something():
    agent = BeliefAgent(OccupancyMapper(SIZE), least_information=0.5)
    agent.reset(2, torch.Generator(), VAR)
    both = torch.stack((nothing(1)[0], arrival([0])[0]))
    assert agent.act(observation(both, (0, 0, 0))).tolist() == [ROTATE_RIGHT, 0]


def test_it_arrives_after_the_sound_has_ended():
    brief = Schedule((0, 0), 3, 0)
    patient = walked(STOP, brief, least_information=0.5)
    assert patient["success"].mean() > 0.8
    assert patient["success_when_silent"].mean() > 0.6
    # one that takes silence for a sound forgets what it heard
    forgetful = walked(STOP, brief)
    assert forgetful["success"].mean() < patient["success"].mean() - 0.2


def test_a_late_sound_costs_time_and_no_success():
    late = walked(VAR, Schedule((5, 5), 100, 0), least_information=0.5)
    assert late["success"].mean() > 0.97
    assert late["spl"].mean() > 0.9, "turns are no part of a path"


def test_evidence_of_silent_places_is_not_counted_nor_forgotten():
    # heard once, in front; then it walks in silence
    agent = BeliefAgent(OccupancyMapper(SIZE), least_information=0.5)
    agent.reset(1, torch.Generator(), VAR)
    agent.act(observation(arrival([0]), (0, 0, 0)))
    before = agent._belief._weight.copy()
    for step in range(1, 4):
        agent.act(observation(nothing(1), (0, step, 0)))
    assert (agent._belief._weight == before).all()
    agent.act(observation(arrival([0]), (0, 4, 0)))
    assert agent._belief._weight.max() == 1.0
    assert agent._belief._weight[agent._belief._weight > 0].min() < 1.0


def test_the_threshold_of_stop_halves():
    """It hears the source 3 m ahead with little certainty, where it is not allowed to walk."""
    steps = []
    for half_life in (None, 10.0, 20.0):
        agent = BeliefAgent(
            OccupancyMapper(SIZE), stop_above=0.9, confirm=False, stop_half_life=half_life
        )
        agent.reset(1, torch.Generator(), STOP)
        uncertain = arrival([0], metres=0.5, sigma=1.0)
        for step in range(200):
            if agent.act(observation(uncertain, (0, 0, step % 4))).item() == STOP_ACTION:
                break
        steps.append(step)
    assert steps[1] < steps[2] < steps[0]


@pytest.mark.parametrize(
    ("options", "key"),
    [({"stop_half_life": 0}, "planner.stop_half_life"),
     ({"least_information": -1}, "planner.least_information")],
)  # fmt: skip
def test_a_mistake_names_its_key(options, key):
    with pytest.raises(UserError, match=key):
        BeliefAgent(OccupancyMapper(SIZE), **options)
