"""The environment for TorchRL: N episodes in one batch, which begin anew by themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor, nn
from torchrl.data import Bounded, Categorical, Composite, Unbounded
from torchrl.envs import EnvBase

from avn.core.errors import UserError
from avn.mapping.ego_map import EgoMap
from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.scene_batch import SceneBatch
from avn.rl.exploration_memory import ExplorationMemory

# What an agent may observe beside what is heard and seen.
OWN = ("collided", "odometry", "map")


class FeatureModule(nn.Module):
    """Resolves the numbers of states and clips into what is seen and heard there.

    It belongs to the environment, and lies where the policy does: numbers travel, features do not,
    and a policy sees features alone.

    Parameters
    ----------
    tables : Tables
    observes : sequence of str
        Names in `tables.visual` and `tables.audio`.
    """

    def __init__(self, tables: SceneBatch, observes: Sequence[str]) -> None:
        super().__init__()
        self.seen = [name for name in observes if name in tables.visual]
        self.heard = [name for name in observes if name in tables.audio]
        for name in (*self.seen, *self.heard):
            table = tables.visual.get(name, tables.audio.get(name))
            self.register_buffer(name, table, persistent=False)

    def range(self, name: str) -> tuple[float, float]:
        """The least and the greatest number of an observation."""
        low, high = torch.aminmax(torch.nan_to_num(getattr(self, name).float()))
        return float(low), float(high)

    def forward(self, state: Tensor, clip: Tensor) -> dict[str, Tensor]:
        """What is observed in states (...,) and in clips (...,), by name, (..., D) each."""
        found = {name: getattr(self, name)[state] for name in self.seen}
        return found | {name: getattr(self, name)[clip] for name in self.heard}


class WalkEnv(EnvBase):
    """Audio-visual navigation in N episodes at once.

    Parameters
    ----------
    world : World
    observes : sequence of str
        What an agent observes: names of visual observations (`visual_embedding`, `local_patch`,
        ...) and of audio ones (`source_estimate`, `audio_embedding`, ...) that the world's tables
        have, and `collided`, `odometry`, `map`.
    explorations : Explorations, optional
        The walks that episodes begin with; their memories are what `h` and `c` begin with.
    memory : int
        Units of the policy's LSTM. Its memory travels with the episode: a policy reads `h` and
        `c` and writes `h_next` and `c_next`.
    map_size, map_width : int
        Of the occupancy map, for `map`.
    resolved : bool
        Whether observations hold features; otherwise they hold `state` and `clip` under `index`,
        which `features` resolves.

    Raises
    ------
    UserError
        Where the tables have no such observation.
    """

    batch_locked = True

    def __init__(
        self,
        world: BatchedEpisodes,
        observes: Sequence[str],
        explorations: ExplorationMemory | None = None,
        memory: int = 0,
        map_size: int = 101,
        map_width: int = 21,
        resolved: bool = True,
    ) -> None:
        super().__init__(device="cpu", batch_size=[world.n])
        tables = world.tables
        known = (*tables.visual, *tables.audio, *OWN)
        for name in observes:
            if name not in known:
                raise UserError(f"observes: '{name}' is none of {', '.join(known)}")
        self.world, self.observes = world, tuple(observes)
        self.features = FeatureModule(tables, observes)
        self.explorations, self.resolved = explorations, resolved
        self.memory_units, self.map_width = memory, map_width
        self._map = EgoMap(world.n, map_size, map_width) if "map" in observes else None
        self._kept = False
        self._everyone = torch.ones(world.n, dtype=torch.bool)
        self.begin(self._everyone)
        self._make_specs()

    # --- plain tensors, which both collectors use ---

    def begin(self, rows: Tensor) -> None:
        """Begin new episodes in some rows, (N,) bool."""
        self.world.begin(rows)
        self.is_init = rows.clone()
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
        """Move every agent; see `World.step`. `h` and `c` are what it remembers from now on."""
        outcome = self.world.step(actions)
        self.is_init = torch.zeros_like(self._everyone)
        if h is not None and c is not None:
            self.h, self.c = h, c
        if self._map is not None:
            self._around = self._look_around(actions)
        return outcome

    def observation(self) -> dict[str, Tensor]:
        """All that there is to know now: numbers of state and clip, own state, memory."""
        found = {"state": self.world.state, "clip": self.world.clip(), "is_init": self.is_init}
        if "collided" in self.observes:
            found["collided"] = self.world.collided
        if "odometry" in self.observes:
            found["odometry"] = self.world.odometry()
        if self._map is not None:
            found["map"] = self._around
        if self.memory_units:
            found |= {"h": self.h, "c": self.c}
        return found

    def state_dict(self, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """All that goes on changing."""
        kept: dict[str, Any] = {"world": self.world.state_dict(), "is_init": self.is_init.clone()}
        if self.memory_units:
            kept |= {"h": self.h.clone(), "c": self.c.clone()}
        if self._map is not None:
            kept |= {"map": self._map.state_dict(), "around": self._around.clone()}
        return kept

    def load_state_dict(self, kept: Mapping[str, Any], *args: Any, **kwargs: Any) -> None:
        """Go on where `state_dict` was taken: the next `reset` of all begins nothing anew."""
        self.world.load_state_dict(kept["world"])
        self.is_init = kept["is_init"].clone()
        if self.memory_units:
            self.h, self.c = kept["h"].clone(), kept["c"].clone()
        if self._map is not None:
            self._map.load_state_dict(kept["map"])
            self._around = kept["around"].clone()
        self._kept = True

    def reset_all(self) -> None:
        """Begin new episodes in all rows, unless a state was just loaded."""
        if not self._kept:
            self.begin(self._everyone)
        self._kept = False

    def _first_memory(self) -> tuple[Tensor, Tensor]:
        explored = self.explorations
        if explored is not None and explored.h.shape[-1]:
            return explored.h[self.world.walk], explored.c[self.world.walk]
        zeros = torch.zeros(self.world.n, 1, self.memory_units)
        return zeros, zeros

    def _look_around(self, actions: Tensor | None) -> Tensor:
        """The map around each agent, and that of its walk, (N, channels, width, width)."""
        assert self._map is not None
        world = self.world
        observation = TensorDict(
            {
                "odometry": world.odometry(),
                "collided": world.collided,
                "local_patch": world.tables.visual["local_patch"][world.state],
            },
            batch_size=[world.n],
        )
        own = self._map.observe(observation, actions)
        if self.explorations is None or not self.explorations.maps:
            return own[:, None]
        return torch.stack((own, self.explorations.map_of_walk(world.walk, world.state)), dim=1)

    # --- what TorchRL asks for ---

    def _observation(self) -> TensorDict:
        found = self.observation()
        numbers = {"state": found.pop("state"), "clip": found.pop("clip")}
        if self.resolved:
            found |= self.features(**numbers)
        else:
            found["index"] = TensorDict(numbers, batch_size=self.batch_size)
        found["is_init"] = found["is_init"][:, None]
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
        self.world.generator.manual_seed(0 if seed is None else seed)

    def _make_specs(self) -> None:
        n, world = self.world.n, self.world
        self.action_spec = Categorical(world.protocol.actions, shape=(n,), dtype=torch.int64)
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
            most = {"state": self.world.tables.states, "clip": max(1, self.world.tables.clips)}
            return Composite(
                {key: _whole(0, most[key] - 1, value[key].shape) for key in most},
                shape=self.batch_size,
            )
        if value.dtype == torch.bool:
            return Categorical(2, shape=value.shape, dtype=torch.bool)
        if name == "map":
            return Bounded(0.0, 1.0, shape=value.shape)
        if name in (*self.features.seen, *self.features.heard):
            return Bounded(*self.features.range(name), shape=value.shape, dtype=value.dtype)
        return Unbounded(shape=value.shape, dtype=value.dtype)


def _whole(low: int, high: int, shape: torch.Size) -> Bounded:
    return Bounded(low, high, shape=shape, dtype=torch.int64)
