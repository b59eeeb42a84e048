"""Two collectors that give the same batches: TorchRL's, and a leaner loop over plain tensors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import torch
from tensordict import TensorDict
from torch import Tensor
from torchrl.collectors import Collector

from avn.rl.environment import WalkEnv
from avn.rl.policy import FeatureLookup, Policy

_NUMBERS = ("state", "clip")


class Batches(Protocol):
    """Gathers batches of N episodes and T steps.

    A batch is a TensorDict (N, T) as TorchRL lays it out: `index`, `is_init`, `action`, `map`,
    `h` and `c` where there are any, and under `next` the same after the action, with `reward`,
    `terminated`, `truncated` and `done`.
    """

    def collect(self) -> TensorDict:
        """The next batch, which begins where the last one ended."""

    def restart(self) -> None:
        """Look at the environment anew, after a state was loaded into it."""


class TorchrlCollector:
    """`torchrl.collectors.Collector`, with numbers that travel and features that do not."""

    def __init__(self, env: WalkEnv, policy: Policy, steps: int) -> None:
        self._collector = Collector(
            env,
            FeatureLookup(env.features, policy),
            frames_per_batch=env.world.n * steps,
            total_frames=-1,
            trust_policy=True,
            track_traj_ids=False,
            use_buffers=False,
        )
        self._batches = iter(self._collector)

    def collect(self) -> TensorDict:
        """The next batch."""
        return next(self._batches)

    def restart(self) -> None:
        """Look at the environment anew."""
        self._collector.reset()


class TensorCollector:
    """The same loop without a TensorDict for each step."""

    def __init__(self, env: WalkEnv, policy: Policy, steps: int) -> None:
        self.env, self.policy, self.steps = env, policy, steps
        self.restart()

    def restart(self) -> None:
        """Look at the environment anew."""
        self.env.reset_all()
        self._seen = self.env.observation()

    def collect(self) -> TensorDict:
        """The next batch."""
        before: list[dict[str, Tensor]] = []
        after: list[dict[str, Tensor]] = []
        for _ in range(self.steps):
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
    """Steps of (N, ...) tensors as a TensorDict (N, T)."""
    found = {name: torch.stack([step[name] for step in steps], dim=1) for name in steps[0]}
    shape = found["state"].shape
    numbers = {name: found.pop(name) for name in _NUMBERS}
    found = {name: value[..., None] if name in _FLAGS else value for name, value in found.items()}
    return TensorDict(found | {"index": TensorDict(numbers, shape)}, shape)


# TorchRL keeps a last axis of 1 for these.
_FLAGS = ("is_init", "reward", "terminated", "truncated", "done")
COLLECTORS: dict[str, Callable[[WalkEnv, Policy, int], Batches]] = {
    "torchrl": TorchrlCollector,
    "tensor": TensorCollector,
}
