"""What the simulator lets an agent see, hear and know of its own movement."""

import dataclasses

import pytest
import torch
from single_episodes import one, pick

from avn.navigation.episodes import exhaustive_episodes, frozen_episodes
from avn.navigation.navigation_scene import DrawnScene
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator

FORWARD, LEFT, RIGHT = 0, 2, 3
NORTH, EAST, SOUTH, WEST = range(4)


@pytest.mark.parametrize(
    ("heading", "expected"),
    [(NORTH, [1, 2, 1]), (EAST, [-2, 1, 0]), (SOUTH, [-1, -2, 3]), (WEST, [2, -1, 2])],
)
def test_odometry_is_in_the_frame_of_the_start(
    two_rooms: DrawnScene, protocols: dict[str, Protocol], heading: int, expected: list[int]
) -> None:
    # Two cells north and one east, ending with the heading east.
    cell = int((two_rooms.grid.lattice == [2, 0]).all(axis=1).nonzero()[0][0])
    simulator = one(two_rooms, protocols["stop"], cell, heading)
    observation = None
    for action in [LEFT] * heading + [FORWARD, FORWARD, RIGHT, FORWARD]:
        observation = simulator.step(torch.tensor([action]))
    assert observation is not None
    assert observation["odometry"].tolist() == [expected]


def test_observations_hold_nothing_else(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    episodes = exhaustive_episodes(two_rooms, ["ring"], protocols["var"], seed=0)
    silent = Simulator(two_rooms, episodes, protocols["var"])
    assert set(silent.reset().keys()) == {"collided", "odometry"}
    hearing = Simulator(
        two_rooms,
        episodes,
        protocols["var"],
        SceneObservations({"source_estimate": torch.zeros(2, 204, 1, 4, 2)}),
    )
    assert set(hearing.reset().keys()) == {"collided", "odometry", "source_estimate"}
    seeing = Simulator(
        two_rooms,
        episodes,
        protocols["var"],
        SceneObservations(visual={"local_patch": torch.zeros(204, 5, 5)}),
    )
    assert set(seeing.reset().keys()) == {"collided", "odometry", "local_patch"}


def test_sights_are_those_of_the_state(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    episodes = exhaustive_episodes(two_rooms, ["ring"], protocols["var"], seed=0)
    numbers = torch.arange(204)[:, None]
    simulator = Simulator(
        two_rooms,
        episodes,
        protocols["var"],
        SceneObservations(visual={"visual_embedding": numbers}),
    )
    assert (simulator.reset()["visual_embedding"][:, 0] == simulator.state).all()
    after = simulator.step(torch.full((len(episodes),), FORWARD))
    assert (after["visual_embedding"][:, 0] == simulator.state).all()
    with pytest.raises(ValueError, match="'visual_embedding' has 203 rows for 204 states"):
        Simulator(
            two_rooms,
            episodes,
            protocols["var"],
            SceneObservations(visual={"visual_embedding": numbers[1:]}),
        )


def test_walks_are_seen_from_their_own_start(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    rules = dataclasses.replace(protocols["var"], exploration_steps=30, num_starts=4)
    episodes = frozen_episodes(two_rooms, ["ring"], rules, 0, "own")
    numbers = torch.arange(204)[:, None]
    simulator = Simulator(
        two_rooms, episodes, rules, SceneObservations(visual={"visual_embedding": numbers})
    )
    trajectories, trajectory_index = simulator.observe_exploration()
    assert trajectories.batch_size == (8, 31)
    assert trajectory_index.tolist() == list(range(8))
    assert (trajectories["odometry"][:, 0] == 0).all()
    assert (trajectories["visual_embedding"][..., 0].numpy() == episodes.trajectories).all()
    moved = trajectories["odometry"][:, 1:, :2] - trajectories["odometry"][:, :-1, :2]
    cells = episodes.trajectories // 4
    assert ((moved.abs().sum(-1) == 1).numpy() == (cells[:, 1:] != cells[:, :-1])).all()
    turned = (trajectories["odometry"][..., 2].numpy() + episodes.trajectories[:, :1]) % 4
    assert (turned == episodes.trajectories % 4).all()
    assert "source_estimate" not in set(trajectories.keys())


def numbered(sounds: int, realisations: int) -> SceneObservations:
    """Hearing whose features are the very indices, for two sources and 204 states."""
    axes = (torch.arange(size) for size in (2, 204, sounds, realisations))
    return SceneObservations(
        {"source_estimate": torch.stack(torch.meshgrid(*axes, indexing="ij"), dim=-1)}
    )


def test_hearing_is_of_the_source_the_state_and_the_sound(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    episodes = exhaustive_episodes(two_rooms, ["ring", "alarm"], protocols["var"], seed=0)
    simulator = Simulator(two_rooms, episodes, protocols["var"], numbered(2, 4))
    actions = torch.randint(4, (30, len(episodes)), generator=torch.Generator().manual_seed(0))
    realisations = []
    for action in actions:
        sound = simulator.step(action)["source_estimate"]
        assert (sound[:, 0] == simulator.source).all()
        assert (sound[:, 1] == simulator.state).all()
        assert (sound[:, 2] == simulator.sound).all()
        realisations.append(sound[:, 3][~simulator.done])
    shares = torch.bincount(torch.cat(realisations)) / len(torch.cat(realisations))
    assert torch.allclose(shares, torch.full((4,), 0.25), atol=0.02)


def test_takes_do_not_depend_on_who_else_is_in_the_batch(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    rules = protocols["stop"]
    every = exhaustive_episodes(two_rooms, ["ring"], rules, seed=0)
    some = torch.arange(0, len(every), 7)
    hearing = numbered(1, 4)
    whole = Simulator(two_rooms, every, rules, hearing)
    part = Simulator(two_rooms, pick(every, some.numpy()), rules, hearing)
    assert (whole.reset()["source_estimate"][some] == part.reset()["source_estimate"]).all()
    different = torch.zeros(len(some), dtype=torch.bool)
    for _ in range(5):
        before = whole.observe()["source_estimate"][some]
        action = torch.full((len(every),), LEFT)
        heard, own = (
            whole.step(action)["source_estimate"][some],
            part.step(action[some])["source_estimate"],
        )
        assert (heard == own).all()
        different |= heard[:, 3] != before[:, 3]
    assert different.float().mean() > 0.9


def test_hearing_of_another_apartment_is_refused(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    episodes = exhaustive_episodes(corridor, ["ring"], protocols["var"], seed=0)
    with pytest.raises(ValueError, match="audio 'source_estimate' has shape"):
        Simulator(corridor, episodes, protocols["var"], numbered(1, 1))
