"""Base class of the algorithms that train actor-critic agents, the config group `algorithm`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf

from tensordict import TensorDict
from torch import Tensor

from avn.core.errors import UserError
from avn.navigation.reward import RewardConfig
from avn.rl.features import FeatureModule
from avn.rl.networks import ActorCritic

UPDATE_ORDERS = ("free", "round_robin")
COLLECTORS = ("tensor", "torchrl")
SCHEDULES = ("constant", "linear")
# Maps a batch to its loss, and to metrics by name.
Loss = Callable[[TensorDict], tuple[Tensor, dict[str, float]]]


@dataclass
class Algorithm(ABC):
    """Reinforcement learning by parallel workers that share weights and RMSProp moments.

    A subclass is a dataclass that adds settings and builds the loss. Each worker collects batches
    and applies the gradients of the loss to the shared weights.

    Attributes
    ----------
    workers : int
        Number of processes, 1 or more.
    num_envs : int
        Episodes that each worker runs in parallel, 1 or more.
    rollout_length : int
        Actions of each episode in a batch, 1 or more.
    total_steps : int
        Total number of actions of all workers, 1 or more.
    updates_per_batch : int
        Gradient updates from each batch, 1 or more.
    update_order : {"free", "round_robin"}
        "free" applies gradients as they come; "round_robin" applies them worker by worker, so
        that training is deterministic. Workers collect in parallel in both cases.
    collector : {"tensor", "torchrl"}
        Collector of the batches: a loop over tensors or the one of TorchRL; both give the same
        batches.
    lr : float
        Learning rate of RMSProp, more than 0.
    alpha : float
        Smoothing constant of the RMSProp moments, 0 to 1.
    eps : float
        Constant that is added to the root of the moments, more than 0.
    schedule : {"constant", "linear"}
        Schedule of the learning rate; "linear" decays it to 0.
    max_grad_norm : float
        Largest norm of a gradient, to which longer ones are scaled; more than 0.
    gamma : float
        Discount factor of rewards, 0 to 1.
    max_steps : int
        Actions after which a training episode is truncated, 1 or more. The return is then
        bootstrapped with the value of the last observation.
    reward : RewardConfig
        Reward of each action.
    realisations : int
        Realisations of each training clip, 1 or more.
    exploration_walks : int
        Exploration trajectories of each training apartment, which episodes share, 1 or more.
    memory_refresh_interval : int
        Batches of a worker after which the LSTM states of the exploration trajectories are
        computed again with the current weights, 1 or more.
    validate_every : int
        Actions between two validations, 1 or more.
    validation_starts : int
        Validation episodes of each source and sound, 1 or more.
    train_seed : int
        Seed of weights, episodes and actions.

    Raises
    ------
    UserError
        If a setting is out of range.
    """

    workers: int = 2
    num_envs: int = 64
    rollout_length: int = 20
    total_steps: int = 3_000_000
    updates_per_batch: int = 1
    update_order: str = "round_robin"
    collector: str = "tensor"
    lr: float = 7e-4
    alpha: float = 0.99
    eps: float = 1e-5
    schedule: str = "linear"
    max_grad_norm: float = 40.0
    gamma: float = 0.99
    max_steps: int = 200
    reward: RewardConfig = field(default_factory=RewardConfig)
    realisations: int = 4
    exploration_walks: int = 32
    memory_refresh_interval: int = 100
    validate_every: int = 250_000
    validation_starts: int = 10
    train_seed: int = 0

    def __post_init__(self) -> None:
        """Check the settings."""
        counts: tuple[str, ...] = (
            "workers",
            "num_envs",
            "rollout_length",
            "total_steps",
            "updates_per_batch",
        )
        counts += ("max_steps", "realisations", "exploration_walks", "memory_refresh_interval")
        counts += ("validate_every", "validation_starts")
        self.check(counts, lambda value: value >= 1, "1 or more")
        self.check(("alpha", "gamma"), lambda value: 0 <= value <= 1, "0 to 1")
        self.check(("lr", "eps"), lambda value: 0 < value < inf, "more than 0")
        self.check(("max_grad_norm",), lambda value: value > 0, "more than 0")
        self._check_names("update_order", UPDATE_ORDERS)
        self._check_names("collector", COLLECTORS)
        self._check_names("schedule", SCHEDULES)

    def check(self, keys: tuple[str, ...], holds: Callable[[float], bool], wanted: str) -> None:
        """Check that settings are in range.

        Parameters
        ----------
        keys : tuple of str
            Names of the settings.
        holds : callable
            Returns True for a valid value.
        wanted : str
            Valid range, for the error message.

        Raises
        ------
        UserError
            If a setting is not valid.
        """
        for key in keys:
            if not holds(getattr(self, key)):
                raise UserError(f"algorithm.{key}: {getattr(self, key)}; give {wanted}")

    def _check_names(self, key: str, known: tuple[str, ...]) -> None:
        if getattr(self, key) not in known:
            value = getattr(self, key)
            raise UserError(f"algorithm.{key}: '{value}' is none of {', '.join(known)}")

    @property
    def batch(self) -> int:
        """Number of actions in one batch of one worker."""
        return self.num_envs * self.rollout_length

    @abstractmethod
    def build_loss(self, network: ActorCritic, features: FeatureModule) -> Loss:
        """Build the loss of one worker.

        Parameters
        ----------
        network : ActorCritic
            Network whose parameters get the gradients.
        features : FeatureModule
            Looks up the features of the states and clips of a batch.

        Returns
        -------
        callable
            Maps a batch (N, T), see `avn.rl.collectors.Batches`, to its loss, and to metrics by
            name. It is called `updates_per_batch` times with each batch, and may store values in
            the batch for its next call.
        """
