"""A3C, and its loss: TorchRL's returns and A2C loss, with the trunk run once.

After Mnih et al., "Asynchronous methods for deep reinforcement learning" (ICML 2016).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from tensordict import TensorDict
from tensordict.nn import (
    ProbabilisticTensorDictModule,
    ProbabilisticTensorDictSequential,
    TensorDictModule,
)
from torch import Tensor
from torchrl.objectives import A2CLoss

from avn.rl.algorithm import Algorithm, Loss
from avn.rl.environment import FeatureModule
from avn.rl.networks import ActorCritic
from avn.rl.rollouts import advantages_and_targets, trunk_outputs


@dataclass
class A3C(Algorithm):
    """Asynchronous advantage actor-critic (Mnih et al., ICML 2016).

    Attributes
    ----------
    gae_lambda : float
        How far ahead advantages look (Schulman et al., ICLR 2016); 1 is all steps of the batch.
    entropy_coef : float
        Weight of the policy's entropy.
    value_coef : float
        Weight of the value's loss.
    """

    gae_lambda: float = 1.0
    entropy_coef: float = 0.1
    value_coef: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check(("gae_lambda",), lambda value: 0 <= value <= 1, "0 to 1")
        self.check(("entropy_coef", "value_coef"), lambda value: value >= 0, "0 or more")

    def build_loss(self, network: ActorCritic, features: FeatureModule) -> Loss:
        """Build the loss of one worker."""
        return ActorCriticLoss(network, features, self)


class ActorCriticLoss:
    """Policy gradient, value and entropy of a batch.

    Parameters
    ----------
    network : ActorCritic
    features : FeatureModule
        Gives the observations for the numbers of the batch.
    recipe : A3C
    """

    def __init__(self, network: ActorCritic, features: FeatureModule, recipe: A3C) -> None:
        self.network, self.features, self.recipe = network, features, recipe
        actor = ProbabilisticTensorDictSequential(
            TensorDictModule(network.actor, ["joint"], ["logits"]),
            ProbabilisticTensorDictModule(
                ["logits"],
                ["action"],
                distribution_class=torch.distributions.Categorical,
                return_log_prob=True,
            ),
        )
        self._loss = A2CLoss(
            actor,
            TensorDictModule(network.critic, ["joint"], ["state_value"]),
            entropy_coeff=recipe.entropy_coef,
            critic_coeff=recipe.value_coef,
            loss_critic_type="l2",
            functional=False,
        )

    def __call__(self, batch: TensorDict) -> tuple[Tensor, dict[str, float]]:
        """The loss, and figures of it by name.

        Parameters
        ----------
        batch : TensorDict (N, T)
            See `avn.rl.collectors.Batches`.
        """
        network, recipe = self.network, self.recipe
        joint = trunk_outputs(network, self.features, batch)
        with torch.no_grad():
            value = network.critic(joint)
            advantage, target = advantages_and_targets(
                network, self.features, batch, value, recipe.gamma, recipe.gae_lambda
            )
        flat = {
            "joint": joint.flatten(0, 1),
            "action": batch["action"].flatten(),
            "advantage": advantage.flatten(0, 1),
            "value_target": target.flatten(0, 1),
        }
        losses = self._loss(TensorDict(flat, batch_size=[batch.numel()]))
        names = {"loss_objective": "policy", "loss_critic": "value", "loss_entropy": "bonus"}
        total = sum(losses[key] for key in names if key in losses)
        figures = {"loss/policy": losses["loss_objective"], "loss/value": losses["loss_critic"]}
        if "entropy" in losses:
            figures["entropy"] = losses["entropy"]
        return total, {name: float(figure.detach()) for name, figure in figures.items()}
