"""The recipe of A3C: one node of the config, `a3c`."""

from __future__ import annotations

from dataclasses import dataclass, field

from avn.core.errors import UserError
from avn.navigation.reward import RewardConfig

ORDERS = ("free", "round_robin")
COLLECTORS = ("lean", "torchrl")
SCHEDULES = ("constant", "linear")


@dataclass
class A3CConfig:
    """How actor-critic agents are trained.

    Attributes
    ----------
    workers, episodes, steps : int
        Processes, the episodes that each runs at once, and the actions in each of them from which
        a gradient is computed.
    total : int
        Actions in all, of all workers together.
    order : {"free", "round_robin"}
        Whether gradients are applied as they come, or worker by worker, so that the same seed gives
        the same bytes; workers gather at the same time either way.
    collector : {"lean", "torchrl"}
        What gathers the batches; both give the same ones.
    lr, alpha, eps, schedule
        Of the RMSProp whose moments the workers share; "linear" lowers the rate to 0.
    gamma, gae_lambda : float
        Discount, and how far ahead returns look; 1 is all steps of the batch.
    entropy, value, clip : float
        Weights of the entropy and of the value's loss, and the largest norm of a gradient.
    max_steps : int
        Actions after which a training episode is cut off; the value of what it saw last stands
        for the rest of the return.
    reward : RewardConfig
    takes : int
        Takes of each training clip that are listened to.
    walks, refresh : int
        Exploration walks of each training apartment that episodes share, and after how many of its
        gradients a worker works through them again with the weights of that time.
    validate_every, validation_starts : int
        After how many actions the agent is measured, and the episodes of each source and sound.
    train_seed : int
        Draws weights, episodes and actions.
    """

    workers: int = 2
    episodes: int = 64
    steps: int = 20
    total: int = 3_000_000
    order: str = "round_robin"
    collector: str = "lean"
    lr: float = 7e-4
    alpha: float = 0.99
    eps: float = 1e-5
    schedule: str = "linear"
    gamma: float = 0.99
    gae_lambda: float = 1.0
    entropy: float = 0.1
    value: float = 0.5
    clip: float = 40.0
    max_steps: int = 200
    reward: RewardConfig = field(default_factory=RewardConfig)
    takes: int = 4
    walks: int = 32
    refresh: int = 100
    validate_every: int = 250_000
    validation_starts: int = 10
    train_seed: int = 0

    @property
    def batch(self) -> int:
        """Actions behind one gradient."""
        return self.episodes * self.steps


def check_recipe(recipe: A3CConfig) -> A3CConfig:
    """Give the recipe back; raises `UserError` for a value that cannot work."""
    for key in ("workers", "episodes", "steps", "total", "max_steps", "takes", "walks", "refresh"):
        if getattr(recipe, key) < 1:
            raise UserError(f"a3c.{key}: {getattr(recipe, key)}; give 1 or more")
    for key in ("validate_every", "validation_starts"):
        if getattr(recipe, key) < 1:
            raise UserError(f"a3c.{key}: {getattr(recipe, key)}; give 1 or more")
    for key, known in (("order", ORDERS), ("collector", COLLECTORS), ("schedule", SCHEDULES)):
        if getattr(recipe, key) not in known:
            raise UserError(f"a3c.{key}: '{getattr(recipe, key)}' is none of {', '.join(known)}")
    for key in ("alpha", "gamma", "gae_lambda"):
        if not 0 <= getattr(recipe, key) <= 1:
            raise UserError(f"a3c.{key}: {getattr(recipe, key)}; give 0 to 1")
    for key in ("lr", "eps", "clip"):
        if not getattr(recipe, key) > 0:
            raise UserError(f"a3c.{key}: {getattr(recipe, key)}; give more than 0")
    for key in ("entropy", "value"):
        if not getattr(recipe, key) >= 0:
            raise UserError(f"a3c.{key}: {getattr(recipe, key)}; give 0 or more")
    return recipe
