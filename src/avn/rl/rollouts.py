"""Inputs of losses: outputs of the trunk over a batch, advantages and value targets."""

from __future__ import annotations

import torch
from tensordict import TensorDict
from torch import Tensor
from torchrl.objectives.value.functional import vec_generalized_advantage_estimate

from avn.rl.features import FeatureModule
from avn.rl.networks import ActorCritic


def trunk_outputs(network: ActorCritic, features: FeatureModule, batch: TensorDict) -> Tensor:
    """Compute the inputs of the heads at each step of a batch, with gradients.

    Parameters
    ----------
    network : ActorCritic
        Network to evaluate.
    features : FeatureModule
        Looks up the features of the states and clips of the batch.
    batch : TensorDict (N, T)
        See `avn.rl.collectors.Batches`.

    Returns
    -------
    (N, T, D) tensor
        Inputs of `network.actor` and `network.critic`.
    """
    inputs = _inputs(batch, features)
    flat = {name: inputs[name].flatten(0, 1) for name in network.spec.inputs}
    embedding = network.embed(flat).unflatten(0, batch.batch_size)
    if network.lstm is None:
        return embedding
    return network.unroll(embedding, batch["h"], batch["c"], batch["is_init"][..., 0])


def advantages_and_targets(
    network: ActorCritic,
    features: FeatureModule,
    batch: TensorDict,
    value: Tensor,
    gamma: float,
    gae_lambda: float,
) -> tuple[Tensor, Tensor]:
    """Compute advantages and value targets by generalized advantage estimation.

    Schulman et al., "High-dimensional continuous control using generalized advantage estimation",
    ICLR 2016. At the last step and at truncated steps, the next value is that of the observation
    after the step.

    Parameters
    ----------
    network : ActorCritic
        Network to evaluate.
    features : FeatureModule
        Looks up the features of the states and clips of the batch.
    batch : TensorDict (N, T)
        See `avn.rl.collectors.Batches`.
    value : (N, T, 1) tensor
        Values of the states of the batch.
    gamma, gae_lambda : float
        Discount factor and lambda, 0 to 1.

    Returns
    -------
    advantage, target : (N, T, 1) tensors
    """
    following = torch.cat((value[:, 1:], torch.zeros_like(value[:, :1])), dim=1)
    ends = batch["next", "truncated"][..., 0].clone()
    ends[:, -1] = True
    ends &= ~batch["next", "terminated"][..., 0]
    if bool(ends.any()):
        seen = batch[ends]
        embedding = network.embed(_inputs(seen["next"], features))
        if network.lstm is not None:
            embedding, _, _ = network.remember(embedding, seen["h_next"], seen["c_next"])
        following[ends] = network.critic(embedding)
    return vec_generalized_advantage_estimate(
        gamma,
        gae_lambda,
        value,
        following,
        batch["next", "reward"].to(value.dtype),
        batch["next", "done"],
        batch["next", "terminated"],
    )


def _inputs(batch: TensorDict, features: FeatureModule) -> dict[str, Tensor]:
    found = features(batch["index", "state"], batch["index", "clip"])
    return found | ({"map": batch["map"]} if "map" in batch else {})
