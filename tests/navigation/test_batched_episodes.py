import numpy as np
import pytest
import torch
from small_worlds import make_trajectories, random_tables

from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.episodes import Episodes
from avn.navigation.navigation_scene import draw
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.navigation.simulator import Simulator
from avn.navigation.start_sampler import build_start_sampler

PROTOCOLS = {
    "var": Protocol("var", "box", False, "moves", max_moves_ratio=2.0),
    "var_stop": Protocol("var_stop", "box", True, "moves", max_moves_ratio=2.0),
    "stop": Protocol("stop", "radius", True, "metres"),
    # caps that episodes run into within the steps of the test
    "short": Protocol("short", "box", False, "metres", max_actions=9),
    "half": Protocol("half", "radius", False, "moves", radius=1.0, max_moves_ratio=1.3),
    "goal_cap": Protocol("goal_cap", "box", False, "moves", max_moves_ratio=1.5, cap="goal"),
    "metres": Protocol("metres", "box", True, "metres", max_moves_ratio=1.5, cap="goal"),
}
SECOND = "aaaa\naBaa\naaaA\naa.a"


@pytest.mark.parametrize("name", PROTOCOLS)
def test_the_world_moves_and_ends_as_the_simulator_does(flat, name):
    protocol = PROTOCOLS[name]
    scenes = [draw("second", SECOND), flat]  # the second place's numbers are shifted
    tables = random_tables(scenes, protocol)
    world = BatchedEpisodes(tables, build_start_sampler(tables), 200, protocol, seed=3)
    here = tables.source_scene[world.source] == 1
    shift, first_source = int(tables.first_state[1]), int((tables.source_scene == 0).sum())
    episodes = Episodes(
        scene="flat",
        seed=0,
        sounds=("one", "two"),
        number=np.arange(int(here.sum())),
        sound=world.sound[here].numpy(),
        source=world.source[here].numpy() - first_source,
        start=world.state[here].numpy() - shift,
        trajectories=np.empty((0, 1), dtype=np.int64),
        trajectory_index=np.full(int(here.sum()), -1),
    )
    simulator = Simulator(flat, episodes, protocol)
    generator = torch.Generator().manual_seed(1)
    for _ in range(25):
        actions = torch.randint(protocol.actions, (200,), generator=generator)
        was_done = simulator.done.clone()
        reward, terminated, truncated = world.step(actions)
        observation = simulator.step(actions[here])
        running = ~was_done
        assert torch.equal(world.state[here][running] - shift, simulator.state[running])
        done = (terminated | truncated)[here]
        assert torch.equal(done[running], simulator.done[running])
        assert torch.equal(world.collided[here][running], observation["collided"][running])
        assert torch.equal(world.odometry()[here][running], observation["odometry"][running])
        success = (reward[here] == 10.0) & running
        assert torch.equal(success, simulator.success & running)
    assert (simulator.done & ~simulator.success).any()  # some stopped elsewhere or ran out


def test_rewards_are_ten_for_success_and_a_tenth_off_for_a_collision(rules):
    scene = draw("row", "aaaaaA")
    tables = random_tables([scene], rules)
    world = BatchedEpisodes(tables, build_start_sampler(tables), 3, rules, max_steps=50)
    east, north = 1, 0
    world.state = torch.tensor([4 * 2 + east, 4 * 3 + east, 4 * 3 + north])
    reward, terminated, truncated = world.step(torch.tensor([0, 0, 0]))
    assert reward.tolist() == pytest.approx([-0.01, 10.0, -0.1])
    assert terminated.tolist() == [False, True, False]
    assert not truncated.any()


def test_a_training_episode_is_cut_off_after_its_steps_and_counts_as_truncated(flat, rules):
    tables = random_tables([flat], rules)
    world = BatchedEpisodes(tables, build_start_sampler(tables), 50, rules, max_steps=7)
    turn = torch.full((50,), 2)
    for step in range(7):
        _, terminated, truncated = world.step(turn)
        assert not terminated.any()
        assert bool(truncated.all()) == (step == 6)


def test_episodes_begin_everywhere_but_at_the_goal_and_equally_often(flat, rules):
    tables = random_tables([draw("second", SECOND), flat], rules)
    starts = build_start_sampler(tables)
    source, _, state = starts.draw(60_000, torch.Generator().manual_seed(0))
    assert not tables.goal[tables.goal_row[source] + state].any()
    assert torch.equal(tables.scene[state], tables.source_scene[source])
    share = torch.bincount(source) / len(source)
    assert share.numpy() == pytest.approx(1 / len(share), abs=0.01)
    own = state[source == 0]
    assert len(own.unique()) == int(starts.count[0])  # every start comes


def test_a_start_was_not_visited_by_the_walk_of_its_episode(flat, rules):
    tables = random_tables([flat], rules)
    trajectories = make_trajectories(tables, trajectories=4, steps=12)
    visited = torch.zeros(1, 4, tables.states, dtype=torch.bool)
    for trajectory_index in range(4):
        visited[0, trajectory_index, trajectories[0, trajectory_index]] = True
    starts = build_start_sampler(tables, visited)
    source, trajectory_index, state = starts.draw(5000, torch.Generator().manual_seed(0))
    assert not visited[tables.source_scene[source], trajectory_index, state].any()


def test_the_clip_that_is_heard_is_that_of_source_state_sound_and_take(flat, rules):
    scenes = [draw("second", SECOND), flat]
    tables = random_tables(scenes, rules)
    world = BatchedEpisodes(tables, build_start_sampler(tables), 64, rules, seed=2)
    generator = torch.Generator().manual_seed(0)
    hearing = []
    for scene in scenes:  # the very numbers of `random_tables`
        states, sources = 4 * len(scene.grid.lattice), len(scene.sources)
        hearing.append(torch.randn(sources, states, 2, 3, 6, generator=generator))
        torch.rand(states, 5, 5, generator=generator)
        torch.randn(states, 8, generator=generator)
    heard = tables.audio["audio_embedding"][world.clip()]
    for row in range(64):
        scene = int(tables.scene[world.state[row]])
        source = int(world.source[row]) - int((tables.source_scene < scene).sum())
        state = int(world.state[row] - tables.first_state[scene])
        expected = hearing[scene][source, state, world.sound[row], world.realisation[row]]
        assert torch.equal(heard[row], expected)


def test_a_world_goes_on_where_its_state_was_taken(flat, rules):
    tables = random_tables([flat], rules)
    world, other = (
        BatchedEpisodes(tables, build_start_sampler(tables), 8, rules, 9, seed=s) for s in (1, 2)
    )
    actions = torch.randint(4, (30, 8), generator=torch.Generator().manual_seed(0))

    def go(which, some):
        seen = []
        for own in some:
            _, terminated, truncated = which.step(own)
            which.begin(terminated | truncated)
            seen.append(torch.stack((which.state, which.clip())))
        return torch.stack(seen)

    go(world, actions[:15])
    other.load_state_dict(world.state_dict())
    assert torch.equal(go(world, actions[15:]), go(other, actions[15:]))


@pytest.mark.parametrize("actions", [[7, 0], [-1, 0], [4, 0], [0.0, 1.0], [[0], [1]], [0]])
def test_actions_that_are_none_are_refused(flat, rules, actions):
    tables = random_tables([flat], rules)
    world = BatchedEpisodes(tables, build_start_sampler(tables), 2, rules)
    before = world.state.clone()
    with pytest.raises(ValueError, match="action"):
        world.step(torch.tensor(actions))
    assert torch.equal(world.state, before)


def test_success_is_what_the_protocol_says_and_not_a_reward(flat):
    protocol = Protocol("stop", "radius", True, "metres")
    tables = random_tables([flat], protocol)
    reward = RewardConfig(success=-1.0, step=2.0)
    world = BatchedEpisodes(
        tables, build_start_sampler(tables), 64, protocol, reward=reward, seed=1
    )
    world.state = torch.arange(64) % tables.states
    goal = tables.goal[tables.goal_row[world.source] + world.state]
    world.step(torch.full((64,), 4))
    assert torch.equal(world.success, goal)
    assert 0 < int(goal.sum()) < 64
    world.begin(torch.ones(64, dtype=torch.bool))
    assert not world.success.any()
