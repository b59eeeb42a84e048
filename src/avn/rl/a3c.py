"""A3C and its loss, with the advantages and the A2C loss of TorchRL.

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
from avn.rl.features import FeatureModule
from avn.rl.networks import ActorCritic
from avn.rl.rollouts import advantages_and_targets, trunk_outputs


@dataclass
class A3C(Algorithm):
    """Asynchronous advantage actor-critic (Mnih et al., ICML 2016).

    Attributes
    ----------
    gae_lambda : float
        Lambda of generalized advantage estimation (Schulman et al., ICLR 2016), 0 to 1; 1 uses
        all rewards of the rollout.
    entropy_coef : float
        Weight of the entropy of the policy, 0 or more.
    value_coef : float
        Weight of the value loss, 0 or more.
    """

    gae_lambda: float = 1.0
    entropy_coef: float = 0.1
    value_coef: float = 0.5

    def __post_init__(self) -> None:
        """Check the settings."""
        super().__post_init__()
        self.check(("gae_lambda",), lambda value: 0 <= value <= 1, "0 to 1")
        self.check(("entropy_coef", "value_coef"), lambda value: value >= 0, "0 or more")

    def build_loss(self, network: ActorCritic, features: FeatureModule) -> Loss:
        """Build the loss of one worker. See `Algorithm.build_loss`."""
        return ActorCriticLoss(network, features, self)


class ActorCriticLoss:
    """Loss of a batch: policy gradient, value loss and entropy.

    Parameters
    ----------
    network : ActorCritic
        Network whose parameters get the gradients.
    features : FeatureModule
        Looks up the features of the states and clips of the batch.
    recipe : A3C
        Coefficients of the loss.
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
        """Compute the loss and its metrics.

        Parameters
        ----------
        batch : TensorDict (N, T)
            See `avn.rl.collectors.Batches`.

        Returns
        -------
        loss : () tensor
        metrics : dict of str to float
            Policy loss, value loss and entropy.
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
        metrics = {"loss/policy": losses["loss_objective"], "loss/value": losses["loss_critic"]}
        if "entropy" in losses:
            metrics["entropy"] = losses["entropy"]
        return total, {name: float(figure.detach()) for name, figure in metrics.items()}
