"""The loss of A3C on a batch: TorchRL's returns and A2C loss, with the trunk run once."""

from __future__ import annotations

import torch
from tensordict import TensorDict
from tensordict.nn import (
    ProbabilisticTensorDictModule,
    ProbabilisticTensorDictSequential,
    TensorDictModule,
)
from torch import Tensor
from torchrl.objectives import A2CLoss
from torchrl.objectives.value.functional import vec_generalized_advantage_estimate

from avn.rl.config import A3CConfig
from avn.rl.environment import FeatureModule
from avn.rl.networks import ActorCritic


class ActorCriticLoss:
    """Policy gradient, value and entropy of a batch (Mnih et al., "Asynchronous methods for deep
    reinforcement learning", ICML 2016).

    Parameters
    ----------
    network : ActorCritic
    features : FeatureModule
        Resolves the numbers of the batch.
    recipe : A3CConfig
    """

    def __init__(self, network: ActorCritic, features: FeatureModule, recipe: A3CConfig) -> None:
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
            entropy_coeff=recipe.entropy,
            critic_coeff=recipe.value,
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
        joint = self.joint(batch)
        with torch.no_grad():
            value = self.network.critic(joint)
            advantage, target = self.returns(batch, value)
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

    def joint(self, batch: TensorDict) -> Tensor:
        """What the heads see at each step, (N, T, D), with gradients."""
        network, shape = self.network, batch.batch_size
        inputs = _inputs(batch, self.features)
        flat = {name: inputs[name].flatten(0, 1) for name in network.shape.inputs}
        embedding = network.embed(flat).unflatten(0, shape)
        if network.lstm is None:
            return embedding
        return network.unroll(embedding, batch["h"], batch["c"], batch["is_init"][..., 0])

    def returns(self, batch: TensorDict, value: Tensor) -> tuple[Tensor, Tensor]:
        """Advantages and targets, (N, T, 1) each.

        The value after a step is that of the next step, but for the last one, and where the
        episode was cut off: there it is that of what was seen then.
        """
        following = torch.cat((value[:, 1:], torch.zeros_like(value[:, :1])), dim=1)
        ends = batch["next", "truncated"][..., 0].clone()
        ends[:, -1] = True
        ends &= ~batch["next", "terminated"][..., 0]
        if bool(ends.any()):
            seen = batch[ends]
            network = self.network
            embedding = network.embed(_inputs(seen["next"], self.features))
            if network.lstm is not None:
                embedding, _, _ = network.remember(embedding, seen["h_next"], seen["c_next"])
            following[ends] = network.critic(embedding)
        advantage, target = vec_generalized_advantage_estimate(
            self.recipe.gamma,
            self.recipe.gae_lambda,
            value,
            following,
            batch["next", "reward"].to(value.dtype),
            batch["next", "done"],
            batch["next", "terminated"],
        )
        return advantage, target


def _inputs(batch: TensorDict, features: FeatureModule) -> dict[str, Tensor]:
    found = features(batch["index", "state"], batch["index", "clip"])
    return found | ({"map": batch["map"]} if "map" in batch else {})
