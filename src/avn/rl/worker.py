"""One worker of A3C: a copy of the network, an environment, and gradients for the shared state."""

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
from avn.rl.environment import WalkEnv
from avn.rl.exploration_memory import ExplorationMemory
from avn.rl.networks import ActorCritic, NetworkSpec
from avn.rl.policy import Policy
from avn.rl.shared import SharedState, flatten_parameters

Lock = Callable[[], AbstractContextManager[Any]]


@dataclass(frozen=True)
class TrainingSpec:
    """What there is to learn: apartments, rules, and the network that learns.

    Attributes
    ----------
    tables : Tables
    protocol : Protocol
    shape : Shape
    recipe : Algorithm
    buffers : dict of str to tensor
        Of the network: how its features are standardised.
    map_size : int
        Squares along each side of the occupancy map.
    walks : (R, W, T) int64 tensor or None
        Exploration walks, for agents that remember.
    top : int
        Entries of the spatial memory that tell where an agent is on the map of its walk.
    """

    tables: SceneBatch
    protocol: Protocol
    shape: NetworkSpec
    recipe: Algorithm
    buffers: dict[str, Tensor]
    map_size: int = 101
    walks: Tensor | None = None
    top: int = 3


class Worker:
    """Gathers batches and applies gradients in its turn.

    Parameters
    ----------
    rank : int
        Number of the worker; it draws other episodes and actions than the others.
    spec : Task
    shared : SharedState
    lock : callable
        Gives the context in which it may change the shared state.
    """

    def __init__(self, rank: int, spec: TrainingSpec, shared: SharedState, lock: Lock) -> None:
        recipe, shape = spec.recipe, spec.shape
        self.rank, self.recipe, self.shared, self.lock = rank, recipe, shared, lock
        self.network = ActorCritic(shape)
        self.network.load_state_dict(spec.buffers, strict=False)
        self.weights, self.gradients = flatten_parameters(self.network)
        self.updates = 0
        self.explorations = None
        if spec.walks is not None:
            map_size = spec.map_size if shape.map_channels else 0
            self.explorations = ExplorationMemory(
                spec.tables, spec.walks, map_size, shape.map_width, spec.top
            )
        visited = None if self.explorations is None else self.explorations.visited()
        seed = derive("a3c", recipe.train_seed, rank) >> 1
        self.policy = Policy(self.network, torch.Generator().manual_seed(seed ^ 1))
        world = BatchedEpisodes(
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
        self.env = WalkEnv(
            world,
            shape.inputs,
            self.explorations,
            shape.memory,
            spec.map_size,
            shape.map_width,
            resolved=False,
        )
        self.loss = recipe.build_loss(self.network, self.env.features)
        self.collector = COLLECTORS[recipe.collector](self.env, self.policy, recipe.rollout_length)
        total = max(1, recipe.total_steps // recipe.batch) * recipe.updates_per_batch
        falling = recipe.schedule == "linear"
        self.rate = lambda done: recipe.lr * (max(0.0, 1 - done / total) if falling else 1.0)
        self.scores, self._refresh = EpisodeStats(recipe.num_envs), recipe.memory_refresh_interval

    def update(self) -> dict[str, float]:
        """Gather one batch and apply its gradients; gives the metrics of the last by name."""
        self._explore()
        batch = self.collector.collect()
        self.scores.take(batch)
        for _ in range(self.recipe.updates_per_batch):
            figures = self._learn(batch)
        self.updates += 1
        return figures

    def _learn(self, batch: TensorDict) -> dict[str, float]:
        self.gradients.zero_()
        loss, figures = self.loss(batch)
        loss.backward()
        figures["gradient_norm"] = self._clip()
        with self.lock():
            recipe = self.recipe
            self.shared.apply(self.gradients, self.rate, recipe.alpha, recipe.eps)
            self._copy_weights()
        return figures

    def run_chunk(
        self, updates: int, progress: Callable[[], None] = lambda: None
    ) -> dict[str, float]:
        """So many updates; gives the means of their figures, and of the episodes that ended."""
        figures = []
        for _ in range(updates):
            figures.append(self.update())
            progress()
        means = {name: sum(f[name] for f in figures) / len(figures) for name in figures[0]}
        return means | self.scores.figures()

    def state_dict(self) -> dict[str, Any]:
        """All that goes on changing, but for the shared state."""
        kept: dict[str, Any] = {
            "env": self.env.state_dict(),
            "actions": self.policy.generator.get_state(),
            "weights": self.weights.clone(),
            "updates": self.updates,
            "scores": self.scores.state_dict(),
        }
        if self.explorations is not None:
            kept["memories"] = (self.explorations.h.clone(), self.explorations.c.clone())
        return kept

    def load_state_dict(self, kept: dict[str, Any]) -> None:
        """Go on where `state_dict` was taken."""
        self.weights.copy_(kept["weights"])
        self.updates = kept["updates"]
        if self.explorations is not None:
            self.explorations.h, self.explorations.c = kept["memories"]
        self.env.load_state_dict(kept["env"])
        self.policy.generator.set_state(kept["actions"])
        self.scores.load_state_dict(kept["scores"])
        self.collector.restart()

    def _explore(self) -> None:
        """Work through the exploration walks again, where it is time to."""
        if self.explorations is not None and self.updates and not self.updates % self._refresh:
            self.explorations.remember(self.network)

    def _copy_weights(self) -> None:
        self.weights.copy_(self.shared.weights)

    def _clip(self) -> float:
        """Shorten the gradient to the recipe's length; gives its length before."""
        norm = float(self.gradients.norm())
        if norm > self.recipe.max_grad_norm:
            self.gradients.mul_(self.recipe.max_grad_norm / norm)
        return norm


class EpisodeStats:
    """Return and success of the training episodes that ended since the last figures."""

    def __init__(self, n: int) -> None:
        self._running = torch.zeros(n)
        self.returns: list[float] = []
        self._successes: list[float] = []

    def take(self, batch: Any) -> None:
        """Take in a batch (N, T)."""
        rewards, done = batch["next", "reward"][..., 0], batch["next", "done"][..., 0]
        for step in range(rewards.shape[1]):
            self._running = self._running + rewards[:, step]
            ended = done[:, step]
            self.returns += self._running[ended].tolist()
            self._successes += (rewards[:, step][ended] > 0).float().tolist()
            self._running = self._running.masked_fill(ended, 0.0)

    def figures(self) -> dict[str, float]:
        """Means by name, of what has ended; nothing where nothing has."""
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
        """All that goes on changing."""
        return self._running.clone(), list(self.returns), list(self._successes)

    def load_state_dict(self, kept: Any) -> None:
        """Go on where `state_dict` was taken."""
        running, returns, successes = kept
        self._running, self.returns, self._successes = running.clone(), [*returns], [*successes]
