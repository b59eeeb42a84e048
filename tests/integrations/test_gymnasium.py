"""The world as Gymnasium sees it, on the real mini split."""

import runpy
import sys
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import avn.rl  # noqa: F401 - makes the environment known

ROOT = Path(__file__).parents[2]
# The options of tests/test_planner_commands.py, so that stages are shared.
SMALL = (
    "split=mini",
    "processes=1",
    "acoustics.rays=300",
    "acoustics.seconds=0.2",
    "sound_model.epochs=1",
    "realisations=1",
    "algorithm.realisations=1",
    "renderer.camera.size=32",
    "renderer.samples=1",
    "renderer.light.gather_rays=4",
    "renderer.light.shadow_rays=2",
    "renderer.light.spacing=0.3",
    "backbone.size=32",
)


@pytest.fixture
def options(outputs):
    return {"overrides": (*SMALL, "model=a3c_va", f"outputs={outputs}"), "max_steps": 20}


@pytest.fixture
def maker():
    """Gymnasium, whose every warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        yield gymnasium


def test_it_passes_gymnasiums_own_checker(maker, options):
    check_env(maker.make("avn/Walk-v0", **options).unwrapped)


def test_an_episode_is_cut_off_or_ends_at_the_goal(maker, options):
    env = maker.make("avn/Walk-v0", **options)
    env.reset(seed=0)
    env.action_space.seed(0)
    ends = set()
    for _ in range(300):
        _, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        assert (reward > 0) == terminated
        if terminated or truncated:
            ends.add("terminated" if terminated else "truncated")
            env.reset()
    assert ends == {"terminated", "truncated"}


def test_the_vector_form_gives_what_single_ones_give(maker, options):
    """One agent in the vector form walks as one alone, with the same draws."""
    single = maker.make("avn/Walk-v0", **options)
    vector = maker.make_vec(
        "avn/Walk-v0", num_envs=1, vectorization_mode="vector_entry_point", **options
    )
    one, _ = single.reset(seed=3)
    many, _ = vector.reset(seed=3)
    generator = np.random.default_rng(0)
    for _ in range(60):
        for name, value in one.items():
            assert np.array_equal(value, many[name][0])
        action = int(generator.integers(4))
        one, reward, terminated, truncated, _ = single.step(action)
        many, rewards, terminateds, truncateds, info = vector.step(np.array([action]))
        assert (reward, terminated, truncated) == (rewards[0], terminateds[0], truncateds[0])
        if terminated or truncated:
            assert np.array_equal(info["final_obs"]["visual_embedding"][0], one["visual_embedding"])
            one, _ = single.reset()


def test_stable_baselines3_learns_in_it(monkeypatch, capsys, outputs):
    script = ROOT / "docs" / "examples" / "stable_baselines3.py"
    options = [own for own in SMALL if not own.startswith(("split=", "sound_model."))]
    monkeypatch.setattr(sys, "argv", [str(script), *options, f"outputs={outputs}"])
    runpy.run_path(str(script))
    words = capsys.readouterr().out.strip().splitlines()[-1].split()
    before, after = float(words[3].rstrip(",")), float(words[5])
    assert after > before + 1.0
