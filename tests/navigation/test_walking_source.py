"""A source that walks, in the simulator and in its records."""

import dataclasses

import numpy as np
import pytest
import torch
from small_places import FLAT, STOP, VAR

from avn.agents.base import Agent
from avn.agents.random_walk import RandomWalk
from avn.agents.rollout import Labels, rollout_scene
from avn.core.sound_mix import SoundMix
from avn.navigation.dynamics import Dynamics
from avn.navigation.episodes import exhaustive_episodes
from avn.navigation.motion import Motion
from avn.navigation.navigation_scene import draw
from avn.navigation.observations import SceneObservations
from avn.navigation.simulator import Simulator

LEFT, HALT = 2, 4
WALKING = Dynamics(motion=Motion(0.5))
BOTH = pytest.mark.parametrize(
    "protocol", [dataclasses.replace(VAR, max_moves_ratio=None), STOP], ids=["var", "stop"]
)


class Heard:
    """Audio observation that is what it was asked to render."""

    sounds, realisations, shape = 1, 1, (len(SoundMix._fields),)

    def __call__(self, clip, mix=None):
        return torch.stack([part.float() for part in mix], 1)


class Turning(Agent):
    """Turns for some actions, then stops where it is if the protocol lets it."""

    def __init__(self, count):
        self.count = count

    def act(self, observation):
        self.count -= 1
        stops = self.count < 0 and self.protocol.requires_stop
        return torch.full((self.n,), HALT if stops else LEFT)


@pytest.fixture(scope="module")
def scene():
    return draw("flat", FLAT.replace("a", "A", 1))


def frame(scene, agent, protocol=STOP, dynamics=WALKING):
    episodes = exhaustive_episodes(scene, ["ring"], protocol, 0)
    labels = Labels("own", "none")
    return rollout_scene(agent, scene, episodes, protocol, labels, dynamics=dynamics)


def simulator(scene, protocol=STOP, dynamics=WALKING, observations=None):
    episodes = exhaustive_episodes(scene, ["ring"], protocol, 0)
    return Simulator(scene, episodes, protocol, observations, dynamics)


def test_it_is_heard_where_it_is_and_where_it_was(scene):
    world = simulator(scene, observations=SceneObservations(rendered={"heard": Heard()}))
    walk = world.course.walk.long()
    assert torch.equal(walk[:, 0].int(), torch.from_numpy(scene.sources)[world.source].int())
    turn = torch.full((len(world),), LEFT)
    for passed, seen in enumerate([world.reset(), *(world.step(turn) for _ in range(5))]):
        place, before = seen["heard"][:, -2:].long().unbind(1)
        # the responses of the free squares follow those of the sources
        assert torch.equal(place - len(scene.sources), walk[:, passed])
        assert torch.equal(before - len(scene.sources), walk[:, max(passed - 1, 0)])


def test_stop_is_judged_by_where_the_source_is_when_the_agent_stops(scene):
    found = frame(scene, Turning(6))
    walk = simulator(scene).course.walk[:, 6].long().numpy()
    assert (found["source_end_cell"] == walk).all()
    moves = scene.grid.distances[walk, found["end_cell"]]
    assert ((moves < 2) == (found["success"] == 1)).all(), "less than 1 m"
    assert 0 < found["success"].mean() < 1
    assert (found["dtg"] == 0.5 * moves).all()


def test_an_agent_that_waits_succeeds_when_the_source_arrives(scene):
    protocol = dataclasses.replace(VAR, max_moves_ratio=None, max_actions=30)
    found = frame(scene, Turning(30), protocol)
    world = simulator(scene, protocol)
    near = torch.from_numpy(protocol.goal_cells(scene.grid, np.arange(scene.grid.cells)))
    there = near[world.course.walk.long(), (world.start // 4)[:, None]]
    came = there.any(1).numpy()
    assert ((found["success"] == 1) == came).all()
    assert 0 < came.mean() < 1
    assert (found["actions"][came] == there.int().argmax(1).numpy()[came]).all()
    assert (found["actions"][~came] == 30).all()


@BOTH
def test_ndtg_is_the_last_distance_in_units_of_the_first(scene, protocol):
    found = frame(scene, RandomWalk(), protocol)
    last = scene.grid.distances[found["source_end_cell"], found["end_cell"]]
    first = scene.grid.distances[found["source_cell"], found["start_cell"]]
    np.testing.assert_allclose(found["ndtg"], last / first)


@BOTH
def test_dspl_is_success_times_fewest_over_taken_actions(scene, protocol):
    found = frame(scene, RandomWalk(), protocol)
    won = found[found["success"] == 1]
    assert (found["dspl"][found["success"] == 0] == 0).all()
    assert (won["actions"] >= won["fewest_actions_to_catch"]).all(), "nobody is earlier"
    np.testing.assert_allclose(won["dspl"], won["fewest_actions_to_catch"] / won["actions"])
    assert 0 < found["dspl"].mean() < found["success"].mean()


@BOTH
def test_a_source_that_never_steps_is_one_that_stays(scene, protocol):
    still = frame(scene, RandomWalk(), protocol, None)
    walking = frame(scene, RandomWalk(), protocol, Dynamics(motion=Motion(0.0)))
    assert (walking[still.columns] == still).all().all()
    assert (walking["source_end_cell"] == walking["source_cell"]).all()
    np.testing.assert_allclose(walking["ndtg"], still["dtg"] / still["geodesic"])


def test_the_walk_is_the_same_whatever_the_agent_does(scene):
    worlds = [simulator(scene) for _ in range(2)]
    for world, action in zip(worlds, (LEFT, 0), strict=True):
        for _ in range(5):
            world.step(torch.full((len(world),), action))
    assert torch.equal(worlds[0].course.walk, worlds[1].course.walk)
