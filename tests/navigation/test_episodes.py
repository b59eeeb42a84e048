import dataclasses

import numpy as np
import pytest

from avn.core.errors import UserError
from avn.navigation.episodes import exhaustive_episodes, frozen_episodes
from avn.navigation.navigation_scene import DrawnScene, draw
from avn.navigation.protocols import Protocol

HALL = "\n".join(["a" * 30] * 14 + ["A" + "a" * 28 + "A"])
SOUNDS = ("ring", "alarm", "clock")
FROZEN = [180, 188, 17, 80, 187, 102, 71, 201, 202, 195, 29, 14]


def test_frozen_list_stays_frozen(two_rooms: DrawnScene, protocols: dict[str, Protocol]) -> None:
    # These very numbers are what published figures rest on: a change here changes every result.
    rules = dataclasses.replace(protocols["var"], num_starts=6)
    episodes = frozen_episodes(two_rooms, ["ring"], rules, seed=0)
    assert episodes.start.tolist() == FROZEN


def test_same_starts_for_all_sounds(two_rooms: DrawnScene, protocols: dict[str, Protocol]) -> None:
    episodes = frozen_episodes(two_rooms, SOUNDS, protocols["var"], seed=3)
    assert len(episodes) == 3 * 2 * 20
    by_sound = [episodes.sound == index for index in range(3)]
    for field in (episodes.start, episodes.source, episodes.number):
        assert (field[by_sound[0]] == field[by_sound[1]]).all()
        assert (field[by_sound[0]] == field[by_sound[2]]).all()
    alone = frozen_episodes(two_rooms, ["clock"], protocols["var"], seed=3)
    assert (alone.start == episodes.start[by_sound[2]]).all()


def test_seed_and_room_change_the_starts(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    first, again, other = (
        frozen_episodes(two_rooms, ["ring"], protocols["var"], seed).start for seed in (0, 0, 1)
    )
    elsewhere = dataclasses.replace(two_rooms, name="elsewhere")
    assert (first == again).all()
    assert (first != other).any()
    assert (first != frozen_episodes(elsewhere, ["ring"], protocols["var"], 0).start).any()


@pytest.mark.parametrize("name", ["var", "var_stop", "stop"])
def test_starts_lie_outside_the_goal_and_differ(
    two_rooms: DrawnScene, protocols: dict[str, Protocol], name: str
) -> None:
    rules = protocols[name]
    episodes = frozen_episodes(two_rooms, ["ring"], rules, seed=0)
    goal = rules.goal_cells(two_rooms.grid, two_rooms.sources)
    assert not goal[episodes.source, episodes.start // 4].any()
    assert len(set(zip(episodes.source.tolist(), episodes.start.tolist(), strict=True))) == 40
    assert set((episodes.start % 4).tolist()) == {0, 1, 2, 3}


def test_starts_lie_outside_the_one_walk_of_a_room(protocols: dict[str, Protocol]) -> None:
    hall = draw("hall", HALL)
    rules = dataclasses.replace(protocols["var"], exploration_steps=400)
    episodes = frozen_episodes(hall, SOUNDS, rules, seed=0)
    assert episodes.trajectories.shape == (1, 401)
    assert (episodes.trajectory_index == 0).all()
    assert not set(episodes.start // 4) & set(episodes.trajectories[0] // 4)
    pairs = set(zip(episodes.source.tolist(), episodes.start.tolist(), strict=True))
    assert len(pairs) == 40


def test_own_walks_differ_and_leave_their_start_unexplored(protocols: dict[str, Protocol]) -> None:
    hall = draw("hall", HALL)
    rules = dataclasses.replace(protocols["var"], exploration_steps=400)
    episodes = frozen_episodes(hall, SOUNDS, rules, seed=0, exploration="own")
    assert episodes.trajectories.shape == (40, 401)
    assert len(np.unique(episodes.trajectories, axis=0)) == 40
    walked = episodes.trajectories[episodes.trajectory_index] // 4
    assert not (walked == (episodes.start // 4)[:, None]).any()
    goal = rules.goal_cells(hall.grid, hall.sources)
    assert not goal[episodes.source, episodes.start // 4].any()
    assert len(np.unique(episodes.start)) > 30


@pytest.mark.parametrize("exploration", ["shared", "own"])
def test_a_walk_that_leaves_too_few_starts_is_cut(
    two_rooms: DrawnScene, protocols: dict[str, Protocol], exploration: str
) -> None:
    # No walk of 5,000 steps leaves a cell of 51; it is cut where enough cells are left.
    rules = dataclasses.replace(protocols["var"], exploration_steps=5000)
    episodes = frozen_episodes(two_rooms, ["ring"], rules, 0, exploration)
    goal = rules.goal_cells(two_rooms.grid, two_rooms.sources)
    least = 5 if exploration == "shared" else 1
    fewest = []
    for number in range(len(episodes)):
        left = ~goal[episodes.source[number]]
        left[episodes.trajectories[episodes.trajectory_index[number]] // 4] = False
        assert left[episodes.start[number] // 4]
        fewest.append(left.sum())
    assert min(fewest) == least


def test_unknown_exploration_is_refused(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    with pytest.raises(UserError, match="exploration: 'none' is none of shared, own"):
        frozen_episodes(two_rooms, ["ring"], protocols["var"], 0, "none")


def test_exhaustive_takes_every_start(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    episodes = exhaustive_episodes(two_rooms, SOUNDS, protocols["var"], seed=0)
    assert len(episodes) == 3 * 2 * (51 - 9) * 4
    key = np.stack((episodes.sound, episodes.source, episodes.start))
    assert len(np.unique(key, axis=1).T) == len(episodes)


def test_too_few_starts_name_the_room(protocols: dict[str, Protocol]) -> None:
    with pytest.raises(UserError, match=r"protocol.num_starts: scene 'hut' has only 16 starts"):
        frozen_episodes(draw("hut", "Aaaaaa"), ["ring"], protocols["var"], seed=0)


def test_keys_tell_episodes_apart(two_rooms: DrawnScene, protocols: dict[str, Protocol]) -> None:
    episodes = exhaustive_episodes(two_rooms, SOUNDS, protocols["var"], seed=0)
    assert len(np.unique(episodes.keys())) == len(episodes)


def test_one_sound_keeps_the_starts_and_uses_every_sound_alike(
    two_rooms: DrawnScene, protocols: dict[str, Protocol]
) -> None:
    crossed = frozen_episodes(two_rooms, SOUNDS, protocols["var"], seed=3)
    single = frozen_episodes(two_rooms, SOUNDS, protocols["var"], seed=3, one_sound=True)
    first = crossed.sound == 0
    for field in ("start", "source", "number", "trajectory_index"):
        assert (getattr(single, field) == getattr(crossed, field)[first]).all()
    assert sorted(np.bincount(single.sound).tolist()) == [13, 13, 14]
    again, other = (
        frozen_episodes(two_rooms, SOUNDS, protocols["var"], seed, one_sound=True).sound
        for seed in (3, 4)
    )
    assert (again == single.sound).all()
    assert (other != single.sound).any()
    # what an episode hears does not depend on the other sounds
    keys = dict(zip(zip(crossed.start, crossed.sound, strict=True), crossed.keys(), strict=True))
    for start, sound, key in zip(single.start, single.sound, single.keys(), strict=True):
        assert keys[start, sound] == key


def test_more_sounds_than_starts(two_rooms: DrawnScene, protocols: dict[str, Protocol]) -> None:
    names = [f"sound_{number}" for number in range(100)]
    single = frozen_episodes(two_rooms, names, protocols["var"], seed=0, one_sound=True)
    assert len(single) == len(set(single.sound.tolist())) == 40
