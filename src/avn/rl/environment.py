"""Environment for TorchRL: N episodes in one batch."""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor
from torchrl.data import Bounded, Categorical, Composite, Unbounded
from torchrl.envs import EnvBase

from avn.core.errors import UserError
from avn.mapping.ego_map import EgoMap
from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.episode_metrics import episode_metrics
from avn.rl.exploration_memory import ExplorationMemory
from avn.rl.features import FeatureModule
from avn.rl.observation_specs import spec_of, to_spec

# Observations that are no features of clips or views.
OWN = ("collided", "odometry", "map")


class NavigationEnv(EnvBase):
    """Audio-visual navigation in N parallel episodes.

    Parameters
    ----------
    episodes : BatchedEpisodes
        States, rewards and ends of the episodes.
    observations : sequence of str
        Names of the observations: visual ones (`visual_embedding`, `view`, ...) and audio ones
        (`audio_embedding`, `waveform`, ...) of `episodes.tables`, and `collided`, `odometry` and
        `map`.
    explorations : ExplorationMemory, optional
        Exploration trajectories, whose LSTM states are the first `h` and `c` of episodes.
    memory : int
        Units of the policy's LSTM; 0 for none. The policy reads `h` and `c`, and writes `h_next`
        and `c_next`.
    map_size, map_width : int
        Squares along each side of the occupancy map, and of its observed part, for `map`.
    resolved : bool
        True if observations hold features, in the ranges of `avn.rl.observation_specs`, and under
        `info` the metrics of the episodes; False if they hold the numbers `state` and `clip` under
        `index`, for `features`.

    Raises
    ------
    UserError
        If an observation does not exist.
    """

    batch_locked = True

    def __init__(
        self,
        episodes: BatchedEpisodes,
        observations: Sequence[str],
        explorations: ExplorationMemory | None = None,
        memory: int = 0,
        map_size: int = 101,
        map_width: int = 21,
        resolved: bool = True,
    ) -> None:
        super().__init__(device="cpu", batch_size=[episodes.n])
        tables = episodes.tables
        known = (*tables.visual, *tables.audio, *tables.rendered, *OWN)
        for name in observations:
            if name not in known:
                raise UserError(f"observations: '{name}' is none of {', '.join(known)}")
        self.episodes, self.observations = episodes, tuple(observations)
        self.features = FeatureModule(tables, observations)
        self.explorations, self.resolved = explorations, resolved
        self.memory_units, self.map_width = memory, map_width
        self._map = EgoMap(episodes.n, map_size, map_width) if "map" in observations else None
        self._kept = False
        self._everyone = torch.ones(episodes.n, dtype=torch.bool)
        self.collisions = torch.zeros(episodes.n, dtype=torch.int64)
        self.begin(self._everyone)
        self._make_specs()

    # --- interface of tensors, for both collectors ---

    def begin(self, rows: Tensor) -> None:
        """Begin new episodes in some rows, (N,) bool."""
        self.episodes.begin(rows)
        self.is_init = rows.clone()
        self.collisions = self.collisions.masked_fill(rows, 0)
        self.forget(rows)

    def forget(self, rows: Tensor) -> None:
        """Clear LSTM states and maps of episodes that have just begun in some rows, (N,) bool."""
        if self.memory_units:
            h, c = self._first_memory()
            if bool(rows.all()):
                self.h, self.c = h, c
            else:
                chosen = rows[:, None, None]
                self.h, self.c = torch.where(chosen, h, self.h), torch.where(chosen, c, self.c)
        if self._map is not None:
            self._map.reset(rows)
            self._around = self._look_around(None)

    def move(
        self, actions: Tensor, h: Tensor | None = None, c: Tensor | None = None
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Move every agent by one action.

        Parameters
        ----------
        actions : (N,) int64
            See `avn.core.actions`.
        h, c : (N, 1, units) float32, optional
            LSTM state after the observation that led to the actions.

        Returns
        -------
        reward, terminated, truncated : (N,) tensors
            See `BatchedEpisodes.step`.
        """
        outcome = self.episodes.step(actions)
        self.collisions = self.collisions + self.episodes.collided
        self.is_init = torch.zeros_like(self._everyone)
        if h is not None and c is not None:
            self.h, self.c = h, c
        if self._map is not None:
            self._around = self._look_around(actions)
        return outcome

    def observation(self) -> dict[str, Tensor]:
        """Return state and clip numbers, `is_init`, `success`, own observations, LSTM state."""
        found = {
            "state": self.episodes.state,
            "clip": self.episodes.clip(),
            "is_init": self.is_init,
            "success": self.episodes.success,
        }
        if "collided" in self.observations:
            found["collided"] = self.episodes.collided
        if "odometry" in self.observations:
            found["odometry"] = self.episodes.odometry()
        if self._map is not None:
            found["map"] = self._around
        if self.memory_units:
            found |= {"h": self.h, "c": self.c}
        return found

    def shown(self) -> dict[str, Tensor]:
        """Return the observations by name, each (N, ...) in its range; see `to_spec`."""
        found = self.observation()
        found |= self.features(found["state"], found["clip"])
        found |= self.episodes.tables.render(self.episodes.clip_id())
        return {name: to_spec(name, found[name]) for name in self.observations}

    def state_dict(self, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Return copies of all tensors that change."""
        kept: dict[str, Any] = {
            "episodes": self.episodes.state_dict(),
            "is_init": self.is_init.clone(),
            "collisions": self.collisions.clone(),
        }
        if self.memory_units:
            kept |= {"h": self.h.clone(), "c": self.c.clone()}
        if self._map is not None:
            kept |= {"map": self._map.state_dict(), "around": self._around.clone()}
        return kept

    def load_state_dict(self, kept: Mapping[str, Any], *args: Any, **kwargs: Any) -> None:
        """Restore what `state_dict` returned; the next `reset_all` then begins no episode."""
        self.episodes.load_state_dict(kept["episodes"])
        self.is_init = kept["is_init"].clone()
        self.collisions = kept.get("collisions", self.collisions).clone()
        if self.memory_units:
            self.h, self.c = kept["h"].clone(), kept["c"].clone()
        if self._map is not None:
            self._map.load_state_dict(kept["map"])
            self._around = kept["around"].clone()
        self._kept = True

    def reset_all(self) -> None:
        """Begin new episodes in all rows, unless `load_state_dict` was just called."""
        if not self._kept:
            self.begin(self._everyone)
        self._kept = False

    def _first_memory(self) -> tuple[Tensor, Tensor]:
        explored = self.explorations
        if explored is not None and explored.h.shape[-1]:
            return explored.h[self.episodes.trajectory_index], explored.c[
                self.episodes.trajectory_index
            ]
        zeros = torch.zeros(self.episodes.n, 1, self.memory_units)
        return zeros, zeros

    def _look_around(self, actions: Tensor | None) -> Tensor:
        """Return the maps around each agent, own and explored, (N, channels, width, width)."""
        assert self._map is not None
        episodes = self.episodes
        observation = TensorDict(
            {
                "odometry": episodes.odometry(),
                "collided": episodes.collided,
                "local_patch": episodes.tables.visual["local_patch"][episodes.state],
            },
            batch_size=[episodes.n],
        )
        own = self._map.observe(observation, actions)
        if self.explorations is None or not self.explorations.maps:
            return own[:, None]
        return torch.stack(
            (own, self.explorations.explored_map(episodes.trajectory_index, episodes.state)), dim=1
        )

    # --- interface of TorchRL ---

    def _observation(self) -> TensorDict:
        found = self.observation()
        numbers = {"state": found.pop("state"), "clip": found.pop("clip")}
        if self.resolved:
            found |= self.shown()
            metrics = episode_metrics(self.episodes, self.collisions)
            own = {name: value[:, None].float() for name, value in metrics.items()}
            own["success"] = metrics["success"][:, None]
            found["info"] = TensorDict(own, batch_size=self.batch_size)
        else:
            found["index"] = TensorDict(numbers, batch_size=self.batch_size)
        for name in ("is_init", "success"):
            found[name] = found[name][:, None]
        return TensorDict(found, batch_size=self.batch_size)

    def _reset(self, tensordict: TensorDictBase | None = None, **kwargs: Any) -> TensorDict:
        if tensordict is None or "_reset" not in tensordict:
            self.reset_all()
        else:
            self.begin(tensordict["_reset"].reshape(-1))
        return self._observation()

    def _step(self, tensordict: TensorDictBase) -> TensorDict:
        reward, terminated, truncated = self.move(
            tensordict["action"], tensordict.get("h_next", None), tensordict.get("c_next", None)
        )
        following = self._observation()
        following["reward"] = reward[:, None]
        following["terminated"] = terminated[:, None]
        following["truncated"] = truncated[:, None]
        following["done"] = (terminated | truncated)[:, None]
        return following

    def _set_seed(self, seed: int | None) -> None:
        self.episodes.seed(secrets.randbits(62) if seed is None else seed)

    def _make_specs(self) -> None:
        n, episodes = self.episodes.n, self.episodes
        self.action_spec = Categorical(episodes.protocol.actions, shape=(n,), dtype=torch.int64)
        self.reward_spec = Unbounded(shape=(n, 1))
        flags = {
            name: Categorical(2, shape=(n, 1), dtype=torch.bool)
            for name in ("done", "terminated", "truncated")
        }
        self.done_spec = Composite(flags, shape=(n,))
        self.observation_spec = Composite(
            {name: self._spec(name, value) for name, value in self._observation().items()},
            shape=(n,),
        )

    def _spec(self, name: str, value: Any) -> Any:
        if name == "index":
            most = {
                "state": self.episodes.tables.states,
                "clip": max(1, self.episodes.tables.clips),
            }
            return Composite(
                {key: _whole(0, most[key] - 1, value[key].shape) for key in most},
                shape=self.batch_size,
            )
        if isinstance(value, TensorDictBase):
            return Composite(
                {key: self._spec(key, own) for key, own in value.items()}, shape=self.batch_size
            )
        if value.dtype == torch.bool:
            return Categorical(2, shape=value.shape, dtype=torch.bool)
        if name in self.observations:
            own = spec_of(name)
            return Bounded(own.low, own.high, shape=value.shape, dtype=value.dtype)
        return Unbounded(shape=value.shape, dtype=value.dtype)


def _whole(low: int, high: int, shape: torch.Size) -> Bounded:
    return Bounded(low, high, shape=shape, dtype=torch.int64)
