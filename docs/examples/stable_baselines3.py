"""Train Stable-Baselines3's A2C on the small apartments."""

import sys

from stable_baselines3 import A2C
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import avn.rl  # noqa: F401 - makes the environment known

overrides = ("model=a3c_v", "split=mini", *sys.argv[1:])
options = {"overrides": overrides, "max_steps": 100}
env = make_vec_env("avn/Walk-v0", n_envs=16, seed=0, env_kwargs=options)
model = A2C("MultiInputPolicy", env, n_steps=20, learning_rate=3e-3, ent_coef=0.01, seed=0)
before, _ = evaluate_policy(model, env, n_eval_episodes=100, deterministic=False, warn=False)
model.learn(40_000)
after, _ = evaluate_policy(model, env, n_eval_episodes=100, deterministic=False, warn=False)
print(f"mean return before {before:.2f}, after {after:.2f}")
