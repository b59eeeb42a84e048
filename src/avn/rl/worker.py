"""Worker of a training: a copy of the network, an environment, and updates of shared weights."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.core.random import derive
from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.protocols import Protocol
from avn.navigation.scene_batch import SceneBatch
from avn.navigation.start_sampler import build_start_sampler
from avn.rl.algorithm import Algorithm
from avn.rl.collectors import COLLECTORS
from avn.rl.environment import NavigationEnv
from avn.rl.exploration_memory import ExplorationMemory
from avn.rl.networks import ActorCritic, NetworkSpec
from avn.rl.policy import Policy
from avn.rl.shared import SharedState, flatten_parameters

Lock = Callable[[], AbstractContextManager[Any]]


@dataclass(frozen=True)
class TrainingSpec:
    """Apartments, protocol, network and algorithm of a training.

    Attributes
    ----------
    tables : SceneBatch
        Training apartments.
    protocol : Protocol
        Actions, goal and limits of the episodes.
    network_spec : NetworkSpec
        Sizes of the network.
    recipe : Algorithm
        Settings of the algorithm.
    buffers : dict of str to tensor
        Buffers of the network: mean and scale of its features.
    map_size : int
        Squares along each side of the occupancy map, odd.
    trajectories : (R, W, T) int64 tensor or None
        Exploration trajectories, for agents with memory.
    top : int
        Entries of the spatial memory that an estimate of the pose averages.
    """

    tables: SceneBatch
    protocol: Protocol
    network_spec: NetworkSpec
    recipe: Algorithm
    buffers: dict[str, Tensor]
    map_size: int = 101
    trajectories: Tensor | None = None
    top: int = 3


class Worker:
    """Worker that collects batches and applies gradients to the shared weights.

    Parameters
    ----------
    rank : int
        Number of the worker, part of the seed of its episodes and actions.
    spec : TrainingSpec
        Apartments, protocol, network and algorithm.
    shared : SharedState
        Weights and optimiser state of all workers.
    lock : callable
        Returns the context in which the worker may change the shared state.
    """

    def __init__(self, rank: int, spec: TrainingSpec, shared: SharedState, lock: Lock) -> None:
        recipe, network_spec = spec.recipe, spec.network_spec
        self.rank, self.recipe, self.shared, self.lock = rank, recipe, shared, lock
        self.network = ActorCritic(network_spec)
        self.network.load_state_dict(spec.buffers, strict=False)
        self.weights, self.gradients = flatten_parameters(self.network)
        self.updates = 0
        self.explorations = None
        if spec.trajectories is not None:
            map_size = spec.map_size if network_spec.map_channels else 0
            self.explorations = ExplorationMemory(
                spec.tables, spec.trajectories, map_size, network_spec.map_width, spec.top
            )
        visited = None if self.explorations is None else self.explorations.visited()
        seed = derive("a3c", recipe.train_seed, rank) >> 1
        self.policy = Policy(self.network, torch.Generator().manual_seed(seed ^ 1))
        episodes = BatchedEpisodes(
            spec.tables,
            build_start_sampler(spec.tables, visited),
            recipe.num_envs,
            spec.protocol,
            recipe.max_steps,
            recipe.reward,
            seed,
        )
        self._copy_weights()
        if self.explorations is not None:
            self.explorations.remember(self.network)
        self.env = NavigationEnv(
            episodes,
            network_spec.inputs,
            self.explorations,
            network_spec.memory,
            spec.map_size,
            network_spec.map_width,
            resolved=False,
        )
        self.loss = recipe.build_loss(self.network, self.env.features)
        self.collector = COLLECTORS[recipe.collector](self.env, self.policy, recipe.rollout_length)
        total = max(1, recipe.total_steps // recipe.batch) * recipe.updates_per_batch
        falling = recipe.schedule == "linear"
        self.rate = lambda done: recipe.lr * (max(0.0, 1 - done / total) if falling else 1.0)
        self.episode_stats, self._refresh = (
            EpisodeStats(recipe.num_envs),
            recipe.memory_refresh_interval,
        )

    def update(self) -> dict[str, float]:
        """Collect one batch, apply its gradients, and return the metrics of the last by name."""
        self._explore()
        batch = self.collector.collect()
        self.episode_stats.update(batch)
        for _ in range(self.recipe.updates_per_batch):
            metrics = self._learn(batch)
        self.updates += 1
        return metrics

    def _learn(self, batch: TensorDict) -> dict[str, float]:
        self.gradients.zero_()
        loss, metrics = self.loss(batch)
        loss.backward()
        metrics["gradient_norm"] = self._clip()
        with self.lock():
            recipe = self.recipe
            self.shared.apply(self.gradients, self.rate, recipe.alpha, recipe.eps)
            self._copy_weights()
        return metrics

    def run_chunk(
        self, updates: int, progress: Callable[[], None] = lambda: None
    ) -> dict[str, float]:
        """Make a number of updates.

        Parameters
        ----------
        updates : int
            Number of batches.
        progress : callable
            Called after each update.

        Returns
        -------
        dict of str to float
            Means of the metrics of all updates, and those of the episodes that ended.
        """
        metrics = []
        for _ in range(updates):
            metrics.append(self.update())
            progress()
        means = {name: sum(f[name] for f in metrics) / len(metrics) for name in metrics[0]}
        return means | self.episode_stats.metrics()

    def state_dict(self) -> dict[str, Any]:
        """Return the state of the worker, without the shared state."""
        kept: dict[str, Any] = {
            "env": self.env.state_dict(),
            "actions": self.policy.generator.get_state(),
            "weights": self.weights.clone(),
            "updates": self.updates,
            "episode_stats": self.episode_stats.state_dict(),
        }
        if self.explorations is not None:
            kept["memories"] = (self.explorations.h.clone(), self.explorations.c.clone())
        return kept

    def load_state_dict(self, kept: dict[str, Any]) -> None:
        """Restore what `state_dict` returned."""
        self.weights.copy_(kept["weights"])
        self.updates = kept["updates"]
        if self.explorations is not None:
            self.explorations.h, self.explorations.c = kept["memories"]
        self.env.load_state_dict(kept["env"])
        self.policy.generator.set_state(kept["actions"])
        self.episode_stats.load_state_dict(kept["episode_stats"])
        self.collector.restart()

    def _explore(self) -> None:
        """Compute the LSTM states of the exploration again, at each refresh interval."""
        if self.explorations is not None and self.updates and not self.updates % self._refresh:
            self.explorations.remember(self.network)

    def _copy_weights(self) -> None:
        self.weights.copy_(self.shared.weights)

    def _clip(self) -> float:
        """Clip the gradient to the largest norm, and return its norm before."""
        norm = float(self.gradients.norm())
        if norm > self.recipe.max_grad_norm:
            self.gradients.mul_(self.recipe.max_grad_norm / norm)
        return norm


class EpisodeStats:
    """Return and success of the training episodes that ended since the last `metrics`.

    Parameters
    ----------
    n : int
        Number of parallel episodes.
    """

    def __init__(self, n: int) -> None:
        self._running = torch.zeros(n)
        self.returns: list[float] = []
        self._successes: list[float] = []

    def update(self, batch: Any) -> None:
        """Add the rewards, ends and successes of a batch (N, T)."""
        rewards, done = batch["next", "reward"][..., 0], batch["next", "done"][..., 0]
        success = batch["next", "success"][..., 0].float()
        for step in range(rewards.shape[1]):
            self._running = self._running + rewards[:, step]
            ended = done[:, step]
            self.returns += self._running[ended].tolist()
            self._successes += success[:, step][ended].tolist()
            self._running = self._running.masked_fill(ended, 0.0)

    def metrics(self) -> dict[str, float]:
        """Return means over the ended episodes by name, if there are any, and reset them."""
        if not self.returns:
            return {}
        count = len(self.returns)
        found = {
            "return": sum(self.returns) / count,
            "success": sum(self._successes) / count,
        }
        self.returns, self._successes = [], []
        return found

    def state_dict(self) -> Any:
        """Return the returns and successes so far."""
        return self._running.clone(), list(self.returns), list(self._successes)

    def load_state_dict(self, kept: Any) -> None:
        """Restore what `state_dict` returned."""
        running, returns, successes = kept
        self._running, self.returns, self._successes = running.clone(), [*returns], [*successes]
