"""Environments for Gymnasium; `import avn.rl` registers them as "avn/Walk-v0"."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from numpy.typing import NDArray
from torch import Tensor

from avn.config import registry
from avn.config.folder import conf_folder
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.protocols import Protocol
from avn.navigation.scene_batch import SceneBatch
from avn.navigation.start_sampler import build_start_sampler
from avn.pipeline import policy, policy_data
from avn.pipeline.occupancy import has_occupancy_model
from avn.pipeline.sound_network import has_sound_model
from avn.pipeline.stage import build
from avn.rl.algorithm import Algorithm
from avn.rl.environment import NavigationEnv

Observation = dict[str, NDArray[Any]]


class NavigationGymEnv(gymnasium.Env[Observation, int]):
    """Gymnasium environment with one agent.

    Parameters
    ----------
    episodes : BatchedEpisodes
        Batch of one episode.
    observes : sequence of str
        Names of the observations; see `avn.rl.environment.NavigationEnv`.
    """

    def __init__(self, episodes: BatchedEpisodes, observes: Sequence[str]) -> None:
        self.metadata = {"render_modes": []}
        self._env = NavigationEnv(episodes, observes)
        self.observation_space: spaces.Space[Any] = _space(self._env)
        self.action_space: spaces.Space[Any] = spaces.Discrete(episodes.protocol.actions)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a new episode. See `gymnasium.Env.reset`."""
        super().reset(seed=seed)
        if seed is not None:
            self._env.set_seed(seed)
        self._env.begin(torch.ones(1, dtype=torch.bool))
        return self._seen(), {}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Take one action. See `gymnasium.Env.step`."""
        outcome = self._env.move(torch.tensor([int(action)]))
        reward, terminated, truncated = (value.item() for value in outcome)
        return self._seen(), float(reward), bool(terminated), bool(truncated), {}

    def _seen(self) -> Observation:
        return {name: value[0] for name, value in _arrays(self._env).items()}


class NavigationVectorEnv(VectorEnv[Observation, NDArray[Any], NDArray[Any]]):
    """Gymnasium environment with N agents; episodes reset in the step in which they end.

    Parameters
    ----------
    episodes : BatchedEpisodes
        Batch of N episodes.
    observes : sequence of str
        Names of the observations; see `avn.rl.environment.NavigationEnv`.
    """

    def __init__(self, episodes: BatchedEpisodes, observes: Sequence[str]) -> None:
        self.metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}
        self._env, self.num_envs = NavigationEnv(episodes, observes), episodes.n
        self.single_observation_space = _space(self._env)
        self.single_action_space = spaces.Discrete(episodes.protocol.actions)
        self.observation_space = batch_space(self.single_observation_space, episodes.n)
        self.action_space = batch_space(self.single_action_space, episodes.n)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin new episodes. See `gymnasium.vector.VectorEnv.reset`."""
        super().reset(seed=seed)
        if seed is not None:
            self._env.set_seed(seed)
        self._env.begin(torch.ones(self.num_envs, dtype=torch.bool))
        return _arrays(self._env), {}

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[Observation, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Take one action in each episode. See `gymnasium.vector.VectorEnv.step`."""
        outcome = self._env.move(torch.as_tensor(actions, dtype=torch.int64))
        reward, terminated, truncated = (value.numpy() for value in outcome)
        done, info = terminated | truncated, {}
        if done.any():
            info = {"final_obs": _arrays(self._env), "_final_obs": done}
            self._env.begin(torch.from_numpy(done))
        return _arrays(self._env), reward.astype(np.float64), terminated, truncated, info


def make_env(
    overrides: Sequence[str] = (),
    part: str = "train",
    observes: Sequence[str] | None = None,
    max_steps: int | None = 200,
    **_: Any,
) -> NavigationGymEnv:
    """Make an environment with one agent in the apartments of a config.

    Parameters
    ----------
    overrides : sequence of str
        Overrides of `python -m avn.train model=a3c_va`, such as `split=mini`.
    part : {"train", "validation"}
        Part of the split whose apartments are used.
    observes : sequence of str, optional
        Names of the observations; those of the model by default.
    max_steps : int or None
        Actions after which an episode is truncated; None for the limits of the protocol.

    Returns
    -------
    NavigationGymEnv

    Raises
    ------
    UserError
        If a setting is not valid.
    """
    return NavigationGymEnv(*_episodes(tuple(overrides), part, 1, observes, max_steps))


def make_vector_env(
    num_envs: int = 1,
    overrides: Sequence[str] = (),
    part: str = "train",
    observes: Sequence[str] | None = None,
    max_steps: int | None = 200,
    **_: Any,
) -> NavigationVectorEnv:
    """Make an environment with N agents in the apartments of a config.

    Parameters
    ----------
    num_envs : int
        N, number of agents.
    overrides, part, observes, max_steps
        See `make_env`.

    Returns
    -------
    NavigationVectorEnv
    """
    return NavigationVectorEnv(*_episodes(tuple(overrides), part, num_envs, observes, max_steps))


def _episodes(
    overrides: tuple[str, ...],
    part: str,
    n: int,
    observes: Sequence[str] | None,
    max_steps: int | None,
) -> tuple[BatchedEpisodes, Sequence[str]]:
    tables, default, protocol, recipe = _tables(overrides, part)
    starts = build_start_sampler(tables)
    episodes = BatchedEpisodes(
        tables, starts, n, protocol, max_steps, recipe.reward, recipe.train_seed
    )
    return episodes, observes or default


@lru_cache(maxsize=4)
def _tables(
    overrides: tuple[str, ...], part: str
) -> tuple[SceneBatch, tuple[str, ...], Protocol, Algorithm]:
    # the environments of one process share the tables
    cfg = _config(overrides)
    if part not in policy_data.SUBSETS:
        raise UserError(f"part: '{part}' is none of {', '.join(policy_data.SUBSETS)}")
    for stage in policy_data.subset_stages(cfg, part):
        build(stage)
    tables = policy_data.tables_of(cfg, policy_data.load_subset(cfg, part))
    heard = ("audio_embedding",) if has_sound_model(cfg) else ()
    names = ("visual_embedding", *heard, *(("map",) if has_occupancy_model(cfg) else ()))
    return tables, names, build_object("protocol", cfg.protocol), policy.build_algorithm(cfg)


def _config(overrides: tuple[str, ...]) -> Any:
    """Compose the config of `avn.train`, also within a command of Hydra."""
    registry.register()
    chosen = [*([] if any(o.startswith("model=") for o in overrides) else ["model=a3c_va"])]
    if GlobalHydra.instance().is_initialized():
        return compose("train", overrides=[*chosen, *overrides])
    with initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"):
        return compose("train", overrides=[*chosen, *overrides])


def _arrays(env: NavigationEnv) -> Observation:
    seen = env.observation()
    shown = env.features(seen["state"], seen["clip"])
    shown |= {name: seen[name] for name in env.observes if name in seen}
    return {name: _array(shown[name]) for name in env.observes}


def _array(value: Tensor) -> NDArray[Any]:
    if value.dtype == torch.bool:
        return value.numpy().astype(np.int8)[:, None]
    return value.float().numpy() if value.dtype == torch.float16 else value.numpy()


def _space(env: NavigationEnv) -> spaces.Dict:
    """Return the observation space of one agent."""
    own: dict[str, spaces.Space[Any]] = {}
    for name, value in _arrays(env).items():
        if name in _RANGES:
            low, high = _RANGES[name]
        else:
            low, high = env.features.range(name)
        own[name] = spaces.Box(low, high, value.shape[1:], value.dtype.type)
    return spaces.Dict(own)


# Odometry counts cells; the bound is more than any apartment has.
_RANGES = {"map": (0.0, 1.0), "collided": (0, 1), "odometry": (-10_000, 10_000)}
