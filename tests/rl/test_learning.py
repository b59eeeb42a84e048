"""A3C learns what there is to learn: the shortest way, and to remember."""

import torch
from small_worlds import make_spec, make_worker

from avn.navigation.distances import fewest_actions
from avn.navigation.navigation_scene import draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.reward import RewardConfig
from avn.navigation.scene_batch import build_scene_batch
from avn.navigation.start_sampler import StartSampler

RULES = Protocol("var", "box", False, "moves", max_moves_ratio=2.0)
LEARN = {
    "num_envs": 16,
    "rollout_length": 10,
    "lr": 3e-3,
    "eps": 1e-5,
    "schedule": "constant",
    "width": 32,
}


def one_hot_tables(scene, hearing=None):
    """Every state looks like no other."""
    states = 4 * len(scene.grid.lattice)
    audio = {} if hearing is None else {"audio_embedding": hearing}
    observed = SceneObservations(audio, {"visual_embedding": torch.eye(states)})
    return build_scene_batch([scene], RULES, [observed])


def learned(spec, updates):
    worker = make_worker(spec)
    for _ in range(updates):
        worker.update()
    return worker


def test_a_corridor_is_solved_to_the_optimal_return():
    scene = draw("corridor", "aaaaaaaA")
    tables = one_hot_tables(scene)
    reward = RewardConfig(step=-0.5, collision=-0.5)  # so that an action more is worth avoiding
    options = {"inputs": ("visual_embedding",), "max_steps": 40, "reward": reward, "gamma": 0.9}
    worker = learned(make_spec(tables, RULES, **(LEARN | options)), 800)
    goal = tables.goal.reshape(1, -1)[:, ::4].numpy()
    optimum = fewest_actions(scene.grid.neighbours, goal, 8)[8, 0]
    world, network = worker.env.episodes, worker.network
    starts = torch.arange(tables.states)[~tables.goal]
    state, earned, done = starts.clone(), torch.zeros(len(starts)), starts < 0
    for _ in range(20):
        with torch.no_grad():
            action = network.actor(
                network.embed({"visual_embedding": torch.eye(tables.states)[state]})
            )
        world.state, world.source = state, torch.zeros_like(state)
        world.n, world.actions, world.attempted = len(state), state * 0, state * 0
        reward, terminated, _ = world.step(action.argmax(dim=1))
        earned += torch.where(done, 0.0, reward)
        done |= terminated
        state = world.state
    expected = 10.0 - 0.5 * (torch.from_numpy(optimum)[starts] - 1)
    assert done.all()
    assert torch.allclose(earned, expected.float(), atol=1e-4)


T_MAZE = """
AaaaaaA
...a...
...a...
...a...
"""


def t_maze_success(memory: int) -> float:
    """Success in a maze whose cue, left or right, is heard at the start alone."""
    scene = draw("t_maze", T_MAZE)
    states = 4 * len(scene.grid.lattice)
    lattice = scene.grid.lattice.tolist()
    start = 4 * lattice.index([3, 0])  # at the foot, facing north
    cue = torch.zeros(2, states, 1, 1, 1)
    left = scene.grid.lattice[scene.sources][:, 0] < 3
    cue[:, start, 0, 0, 0] = torch.where(torch.from_numpy(left), -1.0, 1.0)
    tables = one_hot_tables(scene, cue)
    # three moves, a turn and two moves arrive; a wrong turn does not leave enough
    spec = make_spec(tables, RULES, memory=memory, max_steps=8, **(LEARN | {"entropy_coef": 0.02}))
    worker = make_worker(spec)
    worker.env.episodes.starts = StartSampler(
        1, torch.tensor([start, start]), torch.tensor([0, 1]), torch.tensor([1, 1])
    )
    worker.env.begin(torch.ones(16, dtype=torch.bool))
    worker.collector.restart()
    for _ in range(700):
        worker.update()
    worker.episode_stats.metrics()
    for _ in range(60):
        worker.episode_stats.update(worker.collector.collect())
    return worker.episode_stats.metrics()["success"]


def test_a_t_maze_whose_cue_lies_in_the_past_is_solved_with_memory():
    assert t_maze_success(memory=16) > 0.9


def test_and_not_without_memory():
    assert t_maze_success(memory=0) < 0.65
