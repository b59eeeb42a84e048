"""What changes in the course of an episode, in the simulator and in its records."""

import numpy as np
import pytest
import torch
from small_places import FLAT, STOP, VAR

from avn.agents.base import Agent
from avn.agents.random_walk import RandomWalk
from avn.agents.rollout import Labels, rollout_scene
from avn.core.sound_mix import SoundMix
from avn.navigation.distractor import Distractor
from avn.navigation.dynamics import Dynamics
from avn.navigation.episodes import exhaustive_episodes
from avn.navigation.navigation_scene import draw
from avn.navigation.observations import SceneObservations
from avn.navigation.odometry_noise import OdometryNoise
from avn.navigation.schedule import Schedule
from avn.navigation.simulator import Simulator

FORWARD, BACKWARD, LEFT, RIGHT = range(4)
DISTRACTOR = Distractor({"bark": "dog", "ring": "telephone"})


class Heard:
    """Audio observation that is what it was asked to render."""

    sounds, realisations, shape = 2, 1, (len(SoundMix._fields),)

    def __call__(self, clip, mix=None):
        mix = mix or SoundMix.steady(len(clip.state))
        return torch.stack([part.float() for part in mix], 1)


@pytest.fixture(scope="module")
def scene():
    return draw("flat", FLAT.replace("a", "A", 1))


def simulator(scene, dynamics, protocol=STOP, observations=None):
    episodes = exhaustive_episodes(scene, ["bark", "ring"], protocol, 0)
    return Simulator(scene, episodes, protocol, observations, dynamics)


def test_the_sound_begins_and_ends_by_the_number_of_actions(scene):
    dynamics = Dynamics(schedule=Schedule((2, 2), 4, 0))
    world = simulator(scene, dynamics, observations=SceneObservations(rendered={"heard": Heard()}))
    turn = torch.full((len(world),), LEFT)
    observations = [world.reset(), *(world.step(turn) for _ in range(3))]
    for passed, seen in enumerate(observations):
        begin, end, *others = seen["heard"].unbind(1)
        assert (begin == 2 - passed).all()
        assert (end == 6 - passed).all()
        assert all((other == -1).all() for other in others)


def test_a_distractor_is_the_same_in_every_step_and_for_every_agent(scene):
    dynamics = Dynamics(distractor=DISTRACTOR)
    world = simulator(scene, dynamics, observations=SceneObservations(rendered={"heard": Heard()}))
    first = world.reset()["heard"]
    assert torch.equal(first, world.step(torch.full((len(world),), LEFT))["heard"])
    assert (first[:, 2] != world.source).all()
    assert (first[:, 3] != world.sound).all()
    assert torch.isinf(first[:, :2]).all(), "it sounds all the time"


def test_an_agent_whose_wheels_always_slip_stays_and_counts_its_moves(scene):
    world = simulator(scene, Dynamics(odometry=OdometryNoise(1.0, 0.0)))
    for action in (FORWARD, RIGHT, FORWARD):
        seen = world.step(torch.full((len(world),), action))
    assert torch.equal(world.state, world.start)
    assert not seen["collided"].any(), "wheels that slip are not blocked"
    assert (seen["odometry"] == torch.tensor([1, 1, 1])).all()
    assert (world.moves == 0).all()
    assert (world.attempted == 2).all()
    assert torch.allclose(world.drift(), torch.tensor(2.0**0.5, dtype=torch.float64))


def test_a_rotation_that_goes_too_far_is_counted_once(scene):
    world = simulator(scene, Dynamics(odometry=OdometryNoise(0.0, 1.0)))
    seen = world.step(torch.full((len(world),), RIGHT))
    assert torch.equal(world.state % 4, (world.start + 2) % 4)
    assert torch.equal(world.state // 4, world.start // 4)
    assert (seen["odometry"][:, 2] == 1).all()


@pytest.mark.parametrize("protocol", [VAR, STOP], ids=["var", "stop"])
def test_noise_of_probability_0_is_the_exact_world(scene, protocol):
    exact = simulator(scene, None, protocol)
    noisy = simulator(scene, Dynamics(odometry=OdometryNoise(0.0, 0.0)), protocol)
    random = torch.Generator().manual_seed(0)
    for _ in range(30):
        actions = torch.randint(4, (len(exact),), generator=random)
        one, other = exact.step(actions), noisy.step(actions)
        assert torch.equal(one["odometry"], other["odometry"])
        assert torch.equal(one["collided"], other["collided"])
        assert torch.equal(exact.state, noisy.state)
        assert torch.equal(exact.moves, noisy.moves)


class Scripted(Agent):
    """Turns for some steps, then stops where it is."""

    def __init__(self, steps):
        self.steps = steps

    def reset(self, n, generator, protocol):
        super().reset(n, generator, protocol)
        self.count = 0

    def act(self, observation):
        self.count += 1
        return torch.full((self.n,), 4 if self.count > self.steps else LEFT)


def frame(scene, agent, dynamics, protocol=STOP):
    episodes = exhaustive_episodes(scene, ["bark", "ring"], protocol, 0)
    return rollout_scene(
        agent, scene, episodes, protocol, Labels("own", "none"), None, None, dynamics
    )


def test_records_tell_success_after_the_end_of_the_sound(scene):
    dynamics = Dynamics(schedule=Schedule((0, 5), 10, 5))
    found = frame(scene, RandomWalk(), dynamics, VAR)
    assert (found["sound_ends"] > found["sound_begins"]).all()
    expected = (found["success"] == 1) & (found["actions"] > found["sound_ends"])
    assert (found["success_when_silent"] == expected).all()
    assert 0 < found["success_when_silent"].mean() < found["success"].mean()


def test_records_tell_a_stop_at_the_distractor(scene):
    found = frame(scene, Scripted(3), Dynamics(distractor=DISTRACTOR))
    distance = np.array(
        [
            scene.grid.distances[cell, scene.sources[other]]
            for cell, other in zip(found["end_cell"], found["distractor"], strict=True)
        ]
    )
    assert (found["stopped_at_distractor"] == (distance < 2)).all(), "less than 1 m"
    assert found["stopped_at_distractor"].sum() > 0
    assert (found["distractor_sound"] != found["sound"]).all()
    assert "stopped_at_distractor" not in frame(
        scene, RandomWalk(), Dynamics(distractor=DISTRACTOR), VAR
    )


def test_records_of_a_steady_world_have_no_further_columns(scene):
    plain, noisy = (
        frame(scene, RandomWalk(), dynamics)
        for dynamics in (None, Dynamics(odometry=OdometryNoise(0.2, 0.1)))
    )
    assert set(noisy) - set(plain) == {"slips", "drift"}
    assert noisy["slips"].sum() > 0
    assert noisy["drift"].max() > 0.5
