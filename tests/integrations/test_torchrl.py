"""The world as TorchRL sees it: its own environment, and its wrappers of those of Gymnasium."""

import gymnasium
import numpy as np
import pandas as pd
import pytest
import torch
from torchrl.envs import EnvBase, GymEnv, GymWrapper, check_env_specs

import avn
from avn.core.errors import UserError

PLACES = ("split=mini", "processes=1")
OWN = ("odometry", "collided")


@pytest.fixture
def overrides(outputs):
    return [*PLACES, f"outputs={outputs}"]


@pytest.mark.parametrize("part", ["train", "validation", "test"])
def test_it_passes_torchrls_own_checker(overrides, part):
    env = avn.make_env(overrides, num_envs=3, part=part, observations=OWN)
    assert isinstance(env, EnvBase)
    assert env.batch_size == (3,)
    check_env_specs(env)


def test_wrappers_of_both_forms_pass_it(overrides):
    given = {"overrides": overrides, "observations": OWN, "max_steps": 8}
    check_env_specs(GymEnv("avn/Walk-v0", **given))
    check_env_specs(GymWrapper(gymnasium.make("avn/Walk-v0", **given)))
    for mode in ("SAME_STEP", "DISABLED"):
        vector = gymnasium.make_vec("avn/Walk-v0", num_envs=3, autoreset_mode=mode, **given)
        env = GymWrapper(vector)
        check_env_specs(env)
        assert env.rollout(20, break_when_any_done=False).batch_size == (3, 20)


def test_metrics_are_those_of_the_episode(overrides):
    env = avn.make_env(overrides, num_envs=16, observations=OWN, max_steps=60)
    env.set_seed(0)
    steps = env.rollout(60, break_when_any_done=False)["next"]
    ended, info = steps["terminated"], steps["info"]
    assert torch.equal(info["success"], ended)
    assert torch.equal(steps["success"], ended)
    assert ended.any()
    assert torch.equal(info["spl"] > 0, ended)
    assert info["collisions"].max() > 0


def test_copies_differ_unless_they_are_seeded(overrides):
    def starts(seed):
        env = avn.make_env(overrides, num_envs=16, observations=OWN)
        if seed is not None:
            env.set_seed(seed)
        return env.reset()["info", "distance_to_goal"]

    assert not torch.equal(starts(None), starts(None))
    assert torch.equal(starts(3), starts(3))


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"num_envs": 0}, "num_envs: 0"),
        ({"part": "exam"}, "part: 'exam'"),
        ({"observations": ["rgb"]}, "'rgb' is none of source_estimate"),
        ({"device": "gpu"}, "device: 'gpu'"),
        ({"overrides": ["split=mini", "mapper.size=51"]}, "mapper.size: not read"),
    ],
)
def test_what_does_not_exist_is_one_line(overrides, given, line):
    with pytest.raises(UserError, match=line):
        avn.make_env(**({"overrides": overrides, "observations": OWN} | given))


def test_actions_that_are_none_are_refused(overrides):
    env = avn.make_env(overrides, num_envs=2, observations=OWN)
    first = env.reset()
    for action in (torch.tensor([0, 7]), torch.tensor([0.0, 1.0]), torch.tensor([[0], [1]])):
        with pytest.raises(ValueError, match=r"7 is no action|wanted an int64 tensor"):
            env.step(first.clone().set("action", action))


def forward(observations):
    """Walk on, and turn right after a collision."""
    return 3 * observations["collided"][:, 0]


def test_the_test_part_plays_the_episodes_of_avn_eval(command, overrides, monkeypatch, tmp_path):
    (tmp_path / "walker.py").write_text(
        "def act(observations):\n    return 3 * observations['collided'][:, 0]\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    more = ("protocol.num_starts=3", "seed=2")
    observes = "baseline.observations=[odometry,collided]"
    code, out, err = command(
        "eval", "agent=external", "policy=walker:act", observes, *overrides, *more
    )
    assert code == 0, err
    expected = pd.read_csv(f"{out[-1]}/episodes.csv")
    given = {"overrides": [*overrides, *more], "observations": OWN, "part": "test"}
    env = gymnasium.make_vec("avn/Walk-v0", num_envs=4, **given)
    seen, _ = env.reset()
    found = {}
    while len(found) < len(expected):
        seen, _, _, _, infos = env.step(forward(seen))
        if "final_info" in infos:
            last = infos["final_info"]
            for row in np.flatnonzero(infos["_final_info"]):
                names = ("success", "spl", "distance_to_goal", "collisions", "sound")
                found.setdefault(int(last["episode"][row]), [last[own][row] for own in names])
    rows = expected[["success", "spl", "dtg", "collisions", "sound"]].to_numpy().tolist()
    for number, own in enumerate(rows):
        assert found[number] == own, number
