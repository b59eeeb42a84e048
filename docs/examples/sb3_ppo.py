"""Stable-Baselines3 PPO: `python sb3_ppo.py STEPS split=mini`, then `policy=sb3_ppo:Policy`."""

import sys

from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

import avn  # noqa: F401 - registers the environment


class Policy:
    def __init__(self, weights: str = "sb3_ppo.zip"):
        self.model = PPO.load(weights)

    def __call__(self, observations):
        own = {name: observations[name] for name in self.model.observation_space}
        return self.model.predict(own, deterministic=False)[0]


if __name__ == "__main__":
    steps, overrides = int(sys.argv[1]), sys.argv[2:]
    env = make_vec_env("avn/Walk-v0", n_envs=16, seed=0, env_kwargs={"overrides": overrides})
    PPO("MultiInputPolicy", env, n_steps=64, batch_size=256, seed=0).learn(steps).save("sb3_ppo")
