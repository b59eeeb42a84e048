import numpy as np
import pytest
import torch
from tensordict import TensorDict

from avn.agents.greedy import Greedy
from avn.agents.rollout import Labels, rollout_scene
from avn.core.errors import UserError
from avn.navigation.episodes import exhaustive_episodes
from avn.navigation.navigation_scene import DrawnScene
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol

FORWARD, BACKWARD, LEFT, RIGHT, STOP = range(5)
LABELS = Labels("greedy", "resonance")


def begin(agent: Greedy, n: int, protocol: Protocol) -> Greedy:
    agent.reset(n, torch.Generator().manual_seed(0), protocol)
    return agent


def hearing(*locations: tuple[float, float]) -> TensorDict:
    return TensorDict(
        {"source_estimate": torch.tensor(locations).float()}, batch_size=[len(locations)]
    )


def true_hearing(scene: DrawnScene) -> SceneObservations:
    """The true location of each source, heard from each state, (K, S, 1, 1, 2)."""
    centres = scene.grid.centres
    offset = centres[scene.sources][:, None] - centres[None]
    east, north = offset[..., 0], offset[..., 1]
    right = np.stack((east, -north, -east, north), axis=-1)
    front = np.stack((north, east, -north, -east), axis=-1)
    table = np.stack((right, front), axis=-1).reshape(len(scene.sources), -1, 1, 1, 2)
    return SceneObservations({"source_estimate": torch.from_numpy(table).float()})


def test_turns_to_the_larger_part_and_walks(protocol: Protocol) -> None:
    agent = begin(Greedy(), 6, protocol)
    actions = agent.act(hearing((1, 5), (5, 1), (-5, 1), (1, -5), (-1, -5), (5, 5)))
    assert actions.tolist() == [FORWARD, RIGHT, LEFT, RIGHT, LEFT, FORWARD]


def test_stops_within_reach_only_where_it_may(protocol: Protocol) -> None:
    agent = begin(Greedy(), 5, protocol)
    actions = agent.act(hearing((0.5, 0.6), (0.0, 1.0), (0.6, 0.7), (0.1, 1.5), (-0.1, 0.6)))
    # Half a cell beyond the outermost goal cells: at 0.5 m under "stop", since 1 m is too far.
    expected = {
        "var": [FORWARD] * 5,
        "var_stop": [STOP, FORWARD, STOP, FORWARD, STOP],
        "stop": [FORWARD, FORWARD, FORWARD, FORWARD, STOP],
    }
    assert actions.tolist() == expected[protocol.name]


def test_does_not_turn_for_ever(protocol: Protocol) -> None:
    # What is heard is to the right whichever way it turns.
    agent = begin(Greedy(max_rotations=3), 1, protocol)
    actions = [agent.act(hearing((5.0, 0.0))).item() for _ in range(8)]
    assert actions == [RIGHT, RIGHT, RIGHT, FORWARD, RIGHT, RIGHT, RIGHT, FORWARD]


def test_with_true_hearing_it_arrives_in_an_empty_room(
    hall: DrawnScene, protocol: Protocol
) -> None:
    episodes = exhaustive_episodes(hall, ["ring"], protocol, seed=0)
    frame = rollout_scene(Greedy(), hall, episodes, protocol, LABELS, true_hearing(hall))
    assert (frame["collisions"] == 0).all()
    assert (frame["success"] == 1).all()
    assert (frame["spl"] == 1.0).all()


def test_it_is_blind_to_walls(flat: DrawnScene, protocol: Protocol) -> None:
    episodes = exhaustive_episodes(flat, ["ring"], protocol, seed=0)
    frame = rollout_scene(Greedy(), flat, episodes, protocol, LABELS, true_hearing(flat))
    near, far = frame["rooms_crossed"] == 0, frame["rooms_crossed"] > 0
    assert frame["success"][near].mean() > frame["success"][far].mean() + 0.2
    assert frame["collisions"][far].mean() > 1


def test_wrong_options_name_their_key() -> None:
    with pytest.raises(UserError, match=r"baseline\.slack"):
        Greedy(slack=-1.0)
    with pytest.raises(UserError, match=r"baseline\.max_rotations"):
        Greedy(max_rotations=0)


def test_greedy_is_not_privileged() -> None:
    assert not Greedy.privileged
    assert Greedy.needs == ("source_estimate",)
