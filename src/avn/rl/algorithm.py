"""Base class of the algorithms that train actor-critic agents, the config group `algorithm`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field

from tensordict import TensorDict
from torch import Tensor

from avn.core.errors import UserError
from avn.navigation.reward import RewardConfig
from avn.rl.environment import FeatureModule
from avn.rl.networks import ActorCritic

UPDATE_ORDERS = ("free", "round_robin")
COLLECTORS = ("tensor", "torchrl")
SCHEDULES = ("constant", "linear")
# Gives the loss of a batch, and metrics of it by name.
Loss = Callable[[TensorDict], tuple[Tensor, dict[str, float]]]


@dataclass
class Algorithm(ABC):
    """Reinforcement learning by workers that gather batches and apply gradients in turn.

    A subclass is a dataclass with the settings that it adds, and builds the loss. Workers gather
    the batches, and apply the gradients of the loss with RMSProp.

    Attributes
    ----------
    workers : int
        Processes.
    num_envs : int
        Episodes that each worker runs at once.
    rollout_length : int
        Actions in each episode from which a gradient is computed.
    total_steps : int
        Actions in all, of all workers together.
    updates_per_batch : int
        Gradients that are computed from one batch, one after another.
    update_order : {"free", "round_robin"}
        Whether gradients are applied as they come, or worker by worker, so that the same seed gives
        the same bytes; workers gather at the same time either way.
    collector : {"tensor", "torchrl"}
        What gathers the batches; both give the same ones.
    lr : float
        Learning rate of the RMSProp whose moments the workers share.
    alpha : float
        Smoothing constant of its moments.
    eps : float
        Added to the root of the moments.
    schedule : {"constant", "linear"}
        "linear" lowers the learning rate to 0.
    max_grad_norm : float
        The largest norm of a gradient; longer ones are scaled to it.
    gamma : float
        Discount of rewards.
    max_steps : int
        Actions after which a training episode is cut off; the value of what it saw last stands
        for the rest of the return.
    reward : RewardConfig
        What each action earns.
    realisations : int
        Realisations of each training clip.
    exploration_walks : int
        Exploration walks of each training apartment that episodes share.
    memory_refresh_interval : int
        Batches of a worker after which it works through the exploration walks again with the
        weights of that time.
    validate_every : int
        Actions between two measurements of the agent.
    validation_starts : int
        Episodes of each source and sound of a measurement.
    train_seed : int
        Draws weights, episodes and actions.

    Raises
    ------
    UserError
        For a value that cannot work.
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
        self.check(("lr", "eps", "max_grad_norm"), lambda value: value > 0, "more than 0")
        self._check_names("update_order", UPDATE_ORDERS)
        self._check_names("collector", COLLECTORS)
        self._check_names("schedule", SCHEDULES)

    def check(self, keys: tuple[str, ...], holds: Callable[[float], bool], wanted: str) -> None:
        """Refuse settings out of range.

        Parameters
        ----------
        keys : tuple of str
            Names of the settings.
        holds : callable
            Whether a value can work.
        wanted : str
            The range, for the message.

        Raises
        ------
        UserError
            For the first setting that does not hold.
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
        """Actions in one batch of one worker."""
        return self.num_envs * self.rollout_length

    @abstractmethod
    def build_loss(self, network: ActorCritic, features: FeatureModule) -> Loss:
        """Build the loss of one worker.

        Parameters
        ----------
        network : ActorCritic
            Its parameters get the gradients.
        features : FeatureModule
            Gives the observations for the state and clip numbers of a batch.

        Returns
        -------
        callable
            Takes a batch (N, T), see `avn.rl.collectors.Batches`, and gives the loss, and metrics
            by name. It is called `updates_per_batch` times with each batch, and may keep in the
            batch what its next call needs.
        """
