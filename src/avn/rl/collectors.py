"""Collectors of training batches: the one of TorchRL, and a faster loop over tensors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import torch
from tensordict import TensorDict
from torch import Tensor
from torchrl.collectors import Collector

from avn.rl.environment import NavigationEnv
from avn.rl.policy import FeatureLookup, Policy

_NUMBERS = ("state", "clip")


class Batches(Protocol):
    """Protocol of collectors of batches of N episodes and T steps.

    A batch is a TensorDict (N, T) in the layout of TorchRL: `index`, `is_init`, `success`,
    `action`, and `map`, `h` and `c` if the policy uses them; `next` holds the same after the
    action, and `reward`, `terminated`, `truncated` and `done`.
    """

    def collect(self) -> TensorDict:
        """Collect the next batch, which continues the last one."""

    def restart(self) -> None:
        """Observe the environment again, after its state was loaded."""


class TorchrlCollector:
    """Collector of TorchRL; batches hold state and clip numbers in place of features.

    Parameters
    ----------
    env : NavigationEnv
        Environment with N episodes.
    policy : Policy
        Chooses the actions.
    rollout_length : int
        T, steps of each batch.
    """

    def __init__(self, env: NavigationEnv, policy: Policy, rollout_length: int) -> None:
        self._collector = Collector(
            env,
            FeatureLookup(env.features, policy),
            frames_per_batch=env.episodes.n * rollout_length,
            total_frames=-1,
            trust_policy=True,
            track_traj_ids=False,
            use_buffers=False,
        )
        self._batches = iter(self._collector)

    def collect(self) -> TensorDict:
        """Collect the next batch."""
        return next(self._batches)

    def restart(self) -> None:
        """Observe the environment again."""
        self._collector.reset()


class TensorCollector:
    """Collector that gives the same batches without a TensorDict for each step.

    Parameters
    ----------
    env : NavigationEnv
        Environment with N episodes.
    policy : Policy
        Chooses the actions.
    rollout_length : int
        T, steps of each batch.
    """

    def __init__(self, env: NavigationEnv, policy: Policy, rollout_length: int) -> None:
        self.env, self.policy, self.rollout_length = env, policy, rollout_length
        self.restart()

    def restart(self) -> None:
        """Observe the environment again."""
        self.env.reset_all()
        self._seen = self.env.observation()

    def collect(self) -> TensorDict:
        """Collect the next batch."""
        before: list[dict[str, Tensor]] = []
        after: list[dict[str, Tensor]] = []
        for _ in range(self.rollout_length):
            features = self.env.features(*(self._seen[name] for name in _NUMBERS))
            said = self.policy.choose(self._seen | features)
            action, h, c = said["action"], said.get("h_next"), said.get("c_next")
            reward, terminated, truncated = self.env.move(action, h, c)
            following = self.env.observation()
            before.append(self._seen | said)
            done = terminated | truncated
            ended = {"terminated": terminated, "truncated": truncated, "done": done}
            after.append(following | ended | {"reward": reward})
            if bool(done.any()):
                self.env.begin(done)
                following = self.env.observation()
            self._seen = following
        batch = _laid_out(before)
        batch["next"] = _laid_out(after)
        return batch


def _laid_out(steps: list[dict[str, Tensor]]) -> TensorDict:
    """Stack steps of (N, ...) tensors to a TensorDict (N, T)."""
    found = {name: torch.stack([step[name] for step in steps], dim=1) for name in steps[0]}
    shape = found["state"].shape
    numbers = {name: found.pop(name) for name in _NUMBERS}
    found = {name: value[..., None] if name in _FLAGS else value for name, value in found.items()}
    return TensorDict(found | {"index": TensorDict(numbers, shape)}, shape)


# TorchRL keeps a last axis of 1 for these.
_FLAGS = ("is_init", "success", "reward", "terminated", "truncated", "done")
COLLECTORS: dict[str, Callable[[NavigationEnv, Policy, int], Batches]] = {
    "torchrl": TorchrlCollector,
    "tensor": TensorCollector,
}
