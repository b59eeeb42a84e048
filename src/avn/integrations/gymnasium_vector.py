"""Environment of Gymnasium with N agents in one batch of tensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import torch
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from avn.core.errors import UserError
from avn.core.random import derive
from avn.integrations.render import FPS, RENDER_MODES
from avn.integrations.running import RunningEpisodes
from avn.integrations.spaces import Observation, as_actions, observation_space
from avn.integrations.world import OF_ALGORITHM, MaxSteps, World

Infos = dict[str, Any]


class NavigationVectorEnv(VectorEnv[Observation, NDArray[Any], NDArray[Any]]):
    """Gymnasium environment with N agents.

    Infos have the layout of Gymnasium's vector environments: an array for each name, and under
    `_name` whether each agent has the info. With `AutoresetMode.SAME_STEP`, `final_obs` and
    `final_info` hold the last observation and info of the episodes that ended, and the names
    `scene` and `sound` are in `final_info` alone: TorchRL's wrapper accepts only numbers elsewhere.

    Parameters
    ----------
    world : World
        Apartments and observations.
    num_envs : int
        N, number of agents.
    max_steps : int, "algorithm" or None
        See `avn.integrations.gymnasium.make_env`.
    render_mode : {None, "rgb_array"}
        Mode of `render`.
    autoreset_mode : AutoresetMode
        When an episode that has ended begins anew.

    Raises
    ------
    UserError
        If there is no such mode.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "render_modes": [*RENDER_MODES],
        "render_fps": FPS,
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(
        self,
        world: World,
        num_envs: int,
        max_steps: MaxSteps = OF_ALGORITHM,
        render_mode: str | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    ) -> None:
        self.autoreset_mode = _mode(autoreset_mode)
        self.metadata = {**type(self).metadata, "autoreset_mode": self.autoreset_mode}  # type: ignore[misc]
        self._running, self.num_envs = RunningEpisodes(world, num_envs, max_steps), num_envs
        self.render_mode = render_mode
        self.single_observation_space = observation_space(self._running.env)
        self.single_action_space = spaces.Discrete(self._running.actions)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._over: NDArray[np.bool_] | None = None

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, Infos]:
        """Begin new episodes. See `gymnasium.vector.VectorEnv.reset`.

        Parameters
        ----------
        seed : int or sequence of int, optional
            Seed of all episodes that follow, one for the batch; N of them are combined to one.
        options : dict, optional
            `scene`, `source`, `start` and `sound` of all episodes, see
            `avn.integrations.episode_options.place`; and `reset_mask`, (N,) bool, the episodes to
            begin anew.
        """
        options = dict(options or {})
        rows = self._rows(options.pop("reset_mask", None))
        combined = self._seed(seed)
        super().reset(seed=combined)
        if combined is not None:
            self._running.env.episodes.seed(combined)
        self._running.begin(torch.from_numpy(rows), options)
        self._over = np.zeros(self.num_envs, dtype=np.bool_) if self._over is None else self._over
        self._over = self._over & ~rows
        return self._running.observations(), self._infos(rows)

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[Observation, NDArray[Any], NDArray[Any], NDArray[Any], Infos]:
        """Take one action in each episode. See `gymnasium.vector.VectorEnv.step`."""
        taken = as_actions(actions, self.num_envs, self._running.actions)
        over, mode = self._over, self.autoreset_mode
        if over is None:
            raise UserError("step: there are no running episodes; call reset first")
        if mode == AutoresetMode.DISABLED and over.any():
            raise UserError("step: some episodes are over; call reset with a reset_mask first")
        reward, terminated, truncated = self._running.move(taken)
        if mode == AutoresetMode.NEXT_STEP and over.any():
            self._running.begin(torch.from_numpy(over))
            reward = np.where(over, 0.0, reward)
            terminated, truncated = terminated & ~over, truncated & ~over
        self._over = done = terminated | truncated
        infos: Infos = {}
        if mode == AutoresetMode.SAME_STEP:
            if done.any():
                infos = self._final(done)
                self._running.begin(torch.from_numpy(done))
            self._over = np.zeros_like(done)
        everyone = np.ones(self.num_envs, dtype=np.bool_)
        infos |= self._infos(everyone)
        return self._running.observations(), reward, terminated, truncated, infos

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:  # type: ignore[override]
        """Return the view and the map of each agent; None without a render mode."""
        if self.render_mode is None:
            return None
        return tuple(self._running.picture(row) for row in range(self.num_envs))

    def _infos(self, rows: NDArray[np.bool_]) -> Infos:
        """Return the infos of some rows; without names where TorchRL reads them."""
        infos = self._running.infos()
        if self.autoreset_mode == AutoresetMode.SAME_STEP:
            infos = {name: own for name, own in infos.items() if own.dtype != object}
        return _masked(infos, rows)

    def _final(self, done: NDArray[np.bool_]) -> Infos:
        """Return the last observations and infos of episodes that ended."""
        last = self._running.observations()
        each = np.full(self.num_envs, None, dtype=object)
        for row in np.flatnonzero(done):
            each[row] = {name: value[row].copy() for name, value in last.items()}
        return {
            "final_obs": each,
            "_final_obs": done.copy(),
            "final_info": _masked(self._running.infos(), done),
            "_final_info": done.copy(),
        }

    def _rows(self, mask: Any) -> NDArray[np.bool_]:
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        rows = np.asarray(mask)
        if rows.dtype != np.bool_ or rows.shape != (self.num_envs,) or not rows.any():
            raise UserError(
                f"options: reset_mask is not a bool array of shape ({self.num_envs},) with a True"
            )
        if self._over is None and not rows.all():
            raise UserError("options: reset_mask; the first reset begins all episodes")
        return rows.copy()

    def _seed(self, seed: int | Sequence[int | None] | None) -> int | None:
        if seed is None or isinstance(seed, int | np.integer):
            return None if seed is None else int(seed)
        if len(seed) != self.num_envs:
            raise UserError(f"seed: {len(seed)} seeds for {self.num_envs} agents; give one, or all")
        return None if None in seed else derive("seeds", *seed) >> 2


def _mode(mode: AutoresetMode | str) -> AutoresetMode:
    for known in AutoresetMode:
        if mode in (known, known.value, known.name, known.name.lower()):
            return known
    names = ", ".join(known.name for known in AutoresetMode)
    raise UserError(f"autoreset_mode: {mode!r} is none of {names}")


def _masked(infos: dict[str, NDArray[Any]], rows: NDArray[np.bool_]) -> Infos:
    """Return infos with their masks; those of other rows are 0, or None for texts."""
    found: Infos = {}
    for name, values in infos.items():
        nothing = None if values.dtype == object else values.dtype.type(0)
        kept = values.copy()
        kept[~rows] = nothing
        found[name], found[f"_{name}"] = kept, rows.copy()
    return found
