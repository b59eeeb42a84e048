import numpy as np
import pandas as pd
import pytest
import torch
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent
from avn.agents.greedy import Greedy
from avn.agents.random_walk import RandomWalk
from avn.agents.rollout import Labels, records, rollout, rollout_scene
from avn.core.errors import UserError
from avn.navigation.episodes import exhaustive_episodes, frozen_episodes
from avn.navigation.navigation_scene import DrawnScene
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator
from avn.reporting.results import EPISODE_COLUMNS

LABELS = Labels(agent="test", acoustics="resonance")


class Forward(Agent):
    """Walks straight on, and says Stop after a number of actions where it may."""

    def __init__(self, steps: int = 1000) -> None:
        self.steps = steps
        self.seen: list[TensorDict] = []

    def act(self, observation: TensorDict) -> Tensor:
        self.seen.append(observation)
        stops = self.protocol.requires_stop and len(self.seen) > self.steps
        return torch.full((self.n,), 4 if stops else 0)


def row_of(frame: pd.DataFrame, cell: int, heading: int) -> pd.Series:
    return frame[(frame["start_cell"] == cell) & (frame["start_heading"] == heading)].iloc[0]


def test_records_under_var_by_hand(corridor: DrawnScene, protocols: dict[str, Protocol]) -> None:
    episodes = exhaustive_episodes(corridor, ["ring"], protocols["var"], seed=0)
    frame = rollout_scene(Forward(), corridor, episodes, protocols["var"], LABELS)
    assert tuple(frame.columns) == EPISODE_COLUMNS
    assert len(frame) == 36
    arrived = row_of(frame, cell=4, heading=3)
    assert arrived["outcome"] == "success"
    assert (arrived["path_length"], arrived["shortest"], arrived["fewest_actions"]) == (3, 3, 3)
    assert (arrived["spl"], arrived["softspl"], arrived["sna"]) == (1, 1, 1)
    assert (arrived["geodesic"], arrived["euclidean"], arrived["dtg"]) == (2.0, 2.0, 0.5)
    # East, against the end of the corridor until twice ten moves are attempted.
    lost = row_of(frame, cell=10, heading=1)
    assert (lost["outcome"], lost["path_length"], lost["collisions"]) == ("out_of_moves", 20, 20)
    assert (lost["spl"], lost["softspl"], lost["sna"], lost["dtg"]) == (0, 0, 0, 5.0)
    # Facing away it takes no turn: backward moves do. Facing north it takes one.
    assert row_of(frame, cell=10, heading=1)["fewest_actions"] == 9
    assert row_of(frame, cell=10, heading=0)["fewest_actions"] == 10


def test_records_under_stop_by_hand(corridor: DrawnScene, protocols: dict[str, Protocol]) -> None:
    episodes = exhaustive_episodes(corridor, ["ring"], protocols["stop"], seed=0)
    frame = rollout_scene(Forward(3), corridor, episodes, protocols["stop"], LABELS)
    arrived = row_of(frame, cell=4, heading=3)
    # Three of four moves to the source, 1.5 m of 2.0 m, and Stop: the fewest that succeed.
    assert (arrived["outcome"], arrived["path_length"], arrived["shortest"]) == (
        "success",
        1.5,
        2.0,
    )
    assert (arrived["actions"], arrived["fewest_actions"]) == (4, 4)
    assert (arrived["spl"], arrived["softspl"], arrived["sna_goal"]) == (1.0, 0.75, 1.0)
    assert arrived["dtg"] == 0.5
    short = row_of(frame, cell=8, heading=3)
    assert (short["outcome"], short["dtg"], short["spl"]) == ("stopped_elsewhere", 2.5, 0.0)
    assert short["softspl"] == pytest.approx(1.5 / 4.0)


class Script(Agent):
    """Takes the actions of a list, and then turns."""

    def __init__(self, *actions: int) -> None:
        self.actions = list(actions)

    def act(self, observation: TensorDict) -> Tensor:
        return torch.full((self.n,), self.actions.pop(0) if self.actions else 2)


def test_sna_counts_to_the_source_and_sna_goal_to_the_goal(
    corridor: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    # From cell 4 facing north: a turn, four moves and Stop to the source, three to the goal. The
    # agent turns thrice as often as it has to, and stops at the edge of the goal.
    episodes = exhaustive_episodes(corridor, ["ring"], protocols["stop"], seed=0)
    agent = Script(2, 3, 2, 0, 0, 0, 4)
    frame = rollout_scene(agent, corridor, episodes, protocols["stop"], LABELS)
    row = row_of(frame, cell=4, heading=0)
    assert (row["outcome"], row["actions"]) == ("success", 7)
    assert (row["fewest_actions_to_source"], row["fewest_actions"]) == (6, 5)
    assert (row["sna"], row["sna_goal"]) == (6 / 7, 5 / 7)
    # a failure, and an agent that takes fewer actions than the way to the source has
    assert row_of(frame, cell=8, heading=0)["sna"] == 0.0
    straight = rollout_scene(Script(2, 0, 0, 0, 4), corridor, episodes, protocols["stop"], LABELS)
    row = row_of(straight, cell=4, heading=0)
    assert (row["actions"], row["sna"], row["sna_goal"]) == (5, 1.0, 1.0)
    # without Stop there is none to count
    episodes = exhaustive_episodes(corridor, ["ring"], protocols["var"], seed=0)
    frame = rollout_scene(Script(2, 0, 0, 0), corridor, episodes, protocols["var"], LABELS)
    row = row_of(frame, cell=4, heading=0)
    assert (row["fewest_actions_to_source"], row["fewest_actions"]) == (5, 4)


def test_out_of_actions(corridor: DrawnScene, protocols: dict[str, Protocol]) -> None:
    episodes = exhaustive_episodes(corridor, ["ring"], protocols["stop"], seed=0)
    frame = rollout_scene(Forward(), corridor, episodes, protocols["stop"], LABELS)
    assert set(frame["outcome"]) == {"out_of_actions"}
    assert set(frame["actions"]) == {500}


def test_records_name_sight_rooms_and_sounds(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    episodes = frozen_episodes(two_rooms, ["ring", "clock"], protocols["var"], seed=5)
    frame = rollout_scene(RandomWalk(), two_rooms, episodes, protocols["var"], LABELS)
    assert len(frame) == 2 * 2 * 20
    assert frame["sound"].value_counts().to_dict() == {"ring": 40, "clock": 40}
    assert set(frame["seed"]) == {5}
    other_room = (
        two_rooms.grid.rooms[frame["start_cell"]] != two_rooms.grid.rooms[frame["source_cell"]]
    )
    assert (frame["rooms_crossed"].to_numpy() > 0).tolist() == other_room.tolist()
    seen = two_rooms.in_sight[frame["source"], frame["start_cell"]]
    assert (frame["in_sight"].to_numpy() == seen).all()
    assert (frame["geodesic"] >= frame["euclidean"] - 1e-9).all()


def test_same_seed_same_records(two_rooms: DrawnScene, protocols: dict[str, Protocol]) -> None:
    rules = protocols["var"]
    first, again, other = (
        rollout_scene(
            RandomWalk(),
            two_rooms,
            frozen_episodes(two_rooms, ["ring"], rules, seed),
            rules,
            LABELS,
        )
        for seed in (0, 0, 1)
    )
    pd.testing.assert_frame_equal(first, again)
    assert not first.equals(other)


class Curious(Agent):
    """Not privileged; it keeps whatever it is given."""

    def __init__(self) -> None:
        self.given: list[object] = []

    def act(self, observation: TensorDict) -> Tensor:
        self.given.append(observation)
        return torch.randint(4, (self.n,), generator=self.generator)


def test_unprivileged_agents_get_observations_alone(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    episodes = frozen_episodes(two_rooms, ["ring"], protocols["stop"], seed=0)
    heard = SceneObservations({"source_estimate": torch.rand(2, 204, 1, 1, 2)})
    simulator = Simulator(two_rooms, episodes, protocols["stop"], heard)
    agent = Curious()
    rollout(agent, simulator)
    assert set(vars(agent)) == {"given", "n", "generator", "protocol"}
    assert len(agent.given) == 500
    for given in agent.given:
        assert isinstance(given, TensorDict)
        assert set(given.keys()) == {"source_estimate", "collided", "odometry"}
    with pytest.raises(PermissionError, match="may not see the truth"):
        agent.set_ground_truth(simulator)


def renumbered(scene: DrawnScene, order: np.ndarray) -> DrawnScene:
    """The same apartment, its cells numbered in another order: new cell i was `order[i]`."""
    grid, back = scene.grid, np.append(np.argsort(order), -1).astype(np.int32)
    other = type(grid)(
        lattice=grid.lattice[order],
        neighbours=back[grid.neighbours[order]],
        distances=grid.distances[np.ix_(order, order)],
        rooms=grid.rooms[order],
        squares=grid.squares,
    )
    return DrawnScene(scene.name, other, back[scene.sources], scene.in_sight[:, order])


@pytest.mark.parametrize("agent", [RandomWalk(), Greedy()], ids=["random_walk", "greedy"])
def test_agents_do_not_know_the_numbers_of_states(
    two_rooms: DrawnScene, protocols: dict[str, Protocol], agent: Agent
) -> None:
    rules = protocols["stop"]
    order = np.random.default_rng(0).permutation(51)
    other = renumbered(two_rooms, order)
    states = (4 * order[:, None] + np.arange(4)).reshape(-1)
    hearing = 4 * torch.randn(2, 204, 1, 1, 2, generator=torch.Generator().manual_seed(0))
    episodes = frozen_episodes(two_rooms, ["ring"], rules, seed=0)
    moved = type(episodes)(**{**vars(episodes), "start": np.argsort(states)[episodes.start]})
    first = Simulator(two_rooms, episodes, rules, SceneObservations({"source_estimate": hearing}))
    second = Simulator(
        other, moved, rules, SceneObservations({"source_estimate": hearing[:, states]})
    )
    rollout(agent, first)
    rollout(agent, second)
    assert (torch.from_numpy(states)[second.state] == first.state).all()
    assert (first.state != first.start).any()
    columns = ["success", "path_length", "actions", "collisions", "spl", "softspl", "sna", "dtg"]
    frames = [records(simulator, LABELS)[columns] for simulator in (first, second)]
    pd.testing.assert_frame_equal(*frames)


def test_an_agent_without_what_it_needs_is_refused(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    episodes = frozen_episodes(two_rooms, ["ring"], protocols["var"], seed=0)
    with pytest.raises(
        UserError, match="needs the observation 'source_estimate', which is not there"
    ):
        rollout_scene(Greedy(), two_rooms, episodes, protocols["var"], LABELS)


class Says(Agent):
    """Gives what it is told to."""

    def __init__(self, actions: object) -> None:
        self.actions = actions

    def act(self, observation: TensorDict) -> Tensor:
        return self.actions  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("actions", "line"),
    [
        (torch.zeros(36), "float32 tensor of shape .36,. on cpu; wanted an int64 tensor"),
        (torch.full((36,), torch.nan), "float32 tensor"),
        (torch.zeros(36, 1, dtype=torch.int64), "int64 tensor of shape .36, 1."),
        (torch.zeros(36, dtype=torch.int64, device="meta"), "on meta"),
        (torch.zeros(36, dtype=torch.bool), "bool tensor"),
        (np.zeros(36, dtype=np.int64), "the actions are a ndarray"),
        (None, "the actions are a NoneType"),
        (torch.full((36,), 7), "7 is no action under protocol 'var', whose actions are 0 to 3"),
        (torch.full((36,), -1), "-1 is no action"),
        (torch.full((36,), 4), "Stop is not an action under protocol 'var'"),
    ],
)
def test_actions_that_are_none_name_the_agent(corridor, protocols, actions, line) -> None:
    episodes = exhaustive_episodes(corridor, ["ring"], protocols["var"], seed=0)
    with pytest.raises(UserError, match=f"agent Says: .*{line}") as error:
        rollout_scene(Says(actions), corridor, episodes, protocols["var"], LABELS)
    assert "\n" not in str(error.value)
