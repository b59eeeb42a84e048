"""Environment of Gymnasium with one agent, and the functions behind "avn/Walk-v0".

`import avn` registers the environment, and `gymnasium.make("avn:avn/Walk-v0")` imports it. Actions
are those of `avn.core.actions`. An observation is a dict with an array for each name:

| name | shape, type | meaning |
| --- | --- | --- |
| `view` | (H, W, 3) uint8 | picture of the camera, sRGB |
| `depth` | (H, W) float32 | metres; 0 where there is no surface |
| `visual_embedding` | (D,) float32 | output of the backbone for the view |
| `local_patch` | (5, 5) float32 | probability that cells ahead are free; 0.5 where unknown |
| `map` | (1, W, W) float32 | occupancy map around the agent, 0.5 where unknown |
| `waveform` | (2, rate) float32 | one second of sound at the left and the right ear |
| `spectrogram` | (channels, bands, frames) float32 | spectrogram of that second |
| `audio_embedding` | (D,) float32 | output of the sound network |
| `source_estimate` | (2,) float32 | estimated location of the source, metres right and front |
| `stop_probability` | (1,) float32 | probability that the agent is at the goal |
| `odometry` | (3,) int64 | cells right, cells front and quarter turns since the start |
| `collided` | (1,) int8 | 1 if the last action was a blocked move |

The bounds of the space are constants (`avn.rl.observation_specs`), the same for every apartment and
every network.

An info has `success`, `spl`, `distance_to_goal` (metres along the shortest path to the source),
`collisions`, `scene` and `sound`, and `episode`, the number in the list, if `part="test"`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from avn.core.errors import UserError
from avn.integrations.gymnasium_vector import NavigationVectorEnv
from avn.integrations.render import FPS, RENDER_MODES, check_render_mode
from avn.integrations.running import RunningEpisodes
from avn.integrations.spaces import Observation, as_actions, observation_space
from avn.integrations.world import OF_ALGORITHM, MaxSteps, World, open_world

_OPTIONS = ("overrides", "part", "observations", "max_steps", "render_mode")


class UnknownOptionError(UserError, TypeError):
    """Argument that the environment does not have; a TypeError, as callers in Python expect."""


class NavigationGymEnv(gymnasium.Env[Observation, int]):
    """Gymnasium environment with one agent.

    Parameters
    ----------
    world : World
        Apartments and observations.
    max_steps : int, "algorithm" or None
        See `make_env`.
    render_mode : {None, "rgb_array"}
        Mode of `render`.
    """

    metadata: dict[str, Any] = {"render_modes": [*RENDER_MODES], "render_fps": FPS}  # noqa: RUF012

    def __init__(
        self, world: World, max_steps: MaxSteps = OF_ALGORITHM, render_mode: str | None = None
    ) -> None:
        self._running = RunningEpisodes(world, 1, max_steps)
        self.render_mode = render_mode
        self.observation_space: spaces.Space[Any] = observation_space(self._running.env)
        self.action_space: spaces.Space[Any] = spaces.Discrete(self._running.actions)
        self._is_over = True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a new episode. See `gymnasium.Env.reset`.

        Parameters
        ----------
        seed : int, optional
            Seed of this episode and of those that follow.
        options : dict, optional
            `scene`, `source`, `start` and `sound` of the episode; see
            `avn.integrations.episode_options.place`.
        """
        super().reset(seed=seed)
        if seed is not None:
            self._running.env.episodes.seed(seed)
        self._running.begin(torch.ones(1, dtype=torch.bool), options)
        self._is_over = False
        return self._observation(), self._info()

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Take one action. See `gymnasium.Env.step`."""
        count = self._running.actions
        if np.shape(action) != ():
            raise ValueError(f"action: {action!r}; give an integer from 0 to {count - 1}")
        actions = as_actions([action], 1, count)
        if self._is_over:
            raise UserError("step: there is no running episode; call reset first")
        reward, terminated, truncated = (value.item() for value in self._running.move(actions))
        self._is_over = terminated or truncated
        return self._observation(), reward, terminated, truncated, self._info()

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """Return the view and the map, (400, 800, 3) uint8; None without a render mode."""
        return None if self.render_mode is None else self._running.picture(0)

    def _observation(self) -> Observation:
        return {name: value[0] for name, value in self._running.observations().items()}

    def _info(self) -> dict[str, Any]:
        values = {name: value[0] for name, value in self._running.infos().items()}
        return {k: v.item() if isinstance(v, np.generic) else v for k, v in values.items()}


def make_env(
    overrides: Sequence[str] = (),
    part: str = "train",
    observations: Sequence[str] | None = None,
    max_steps: MaxSteps = OF_ALGORITHM,
    render_mode: str | None = None,
    **unknown: Any,
) -> NavigationGymEnv:
    """Make an environment with one agent in the apartments of a config.

    Parameters
    ----------
    overrides : sequence of str
        Settings of `avn.eval agent=external`, such as `split=mini`. A row of the table,
        `agent=a3c_va` or `model=a3c_va`, selects the observations of its agent.
    part : {"train", "validation", "test"}
        Part of the split. "train" and "validation" draw episodes in the apartments of the training
        world. "test" plays the episodes of `avn.eval` in their order, and then again.
    observations : sequence of str, optional
        Names of the observations; see the module.
    max_steps : int, "algorithm" or None
        Actions after which an episode is truncated: a number, that of `algorithm.max_steps`, or the
        limits of the protocol alone.
    render_mode : {None, "rgb_array"}
        "rgb_array" for pictures of the view and the map.
    **unknown
        Refused.

    Returns
    -------
    NavigationGymEnv
        Two environments have different episodes, unless they are seeded.

    Raises
    ------
    UserError
        If a setting is not valid, or the environment does not read it.
    """
    _refuse(unknown, _OPTIONS)
    check_render_mode(render_mode)
    world = open_world(overrides, part, observations, max_steps, render_mode is not None)
    return NavigationGymEnv(world, max_steps, render_mode)


def make_vector_env(
    num_envs: int = 1,
    overrides: Sequence[str] = (),
    part: str = "train",
    observations: Sequence[str] | None = None,
    max_steps: MaxSteps = OF_ALGORITHM,
    render_mode: str | None = None,
    autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    **unknown: Any,
) -> NavigationVectorEnv:
    """Make an environment with N agents in the apartments of a config.

    Parameters
    ----------
    num_envs : int
        N, number of agents.
    overrides, part, observations, max_steps, render_mode
        See `make_env`.
    autoreset_mode : AutoresetMode
        When an episode that has ended begins anew: in the same step, in the next one, or by `reset`
        with `options={"reset_mask": mask}` alone.
    **unknown
        Refused.

    Returns
    -------
    NavigationVectorEnv
    """
    _refuse(unknown, ("num_envs", *_OPTIONS, "autoreset_mode"))
    check_render_mode(render_mode)
    check_num_envs(num_envs)
    world = open_world(overrides, part, observations, max_steps, render_mode is not None)
    return NavigationVectorEnv(world, num_envs, max_steps, render_mode, autoreset_mode)


def check_num_envs(num_envs: Any) -> None:
    """Raise `UserError` for a number of agents below 1."""
    if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
        raise UserError(f"num_envs: {num_envs!r}; give 1 or more")


def _refuse(unknown: dict[str, Any], known: Sequence[str]) -> None:
    for name, value in unknown.items():
        raise UnknownOptionError(
            f"unexpected keyword argument '{name}': not an option of the environment; there are "
            f"{', '.join(known)}, and settings are given as overrides=['{name}={value}']"
        )
