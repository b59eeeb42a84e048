"""Policies of TorchRL that map features to actions and LSTM states."""

from __future__ import annotations

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor

from avn.rl.features import FeatureModule
from avn.rl.networks import ActorCritic, sample


class Policy(TensorDictModuleBase):
    """Actor-critic network as a policy of TorchRL.

    Parameters
    ----------
    network : ActorCritic
        Gives the logits and the LSTM state.
    generator : torch.Generator
        Source of the random numbers of the actions.
    """

    def __init__(self, network: ActorCritic, generator: torch.Generator) -> None:
        super().__init__()
        self.network, self.generator = network, generator
        memory = ["h", "c"] if network.spec.memory else []
        self.in_keys = [*network.spec.inputs, *memory]
        self.out_keys = ["action", *(f"{name}_next" for name in memory)]

    @torch.no_grad()
    def choose(self, seen: dict[str, Tensor]) -> dict[str, Tensor]:
        """Sample actions (N,) for N observations, and compute the next LSTM state, by name."""
        network = self.network
        embedding = network.embed({name: seen[name] for name in network.spec.inputs})
        if network.lstm is None:
            return {"action": sample(network.actor(embedding), self.generator)}
        joint, h, c = network.remember(embedding, seen["h"], seen["c"])
        return {"action": sample(network.actor(joint), self.generator), "h_next": h, "c_next": c}

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Write actions and LSTM state into a TensorDict."""
        seen = {name: tensordict[name] for name in self.in_keys}
        return tensordict.update(self.choose(seen))


class FeatureLookup(TensorDictModuleBase):
    """Policy with a feature lookup in front, for environments that give numbers.

    Parameters
    ----------
    features : FeatureModule
        Looks up the features of states and clips.
    policy : TensorDictModuleBase
        Policy that takes features.
    """

    def __init__(self, features: FeatureModule, policy: TensorDictModuleBase) -> None:
        super().__init__()
        self.features, self.policy = features, policy
        resolved = {*features.visual, *features.audio}
        self.in_keys = [key for key in policy.in_keys if key not in resolved]
        self.in_keys += [("index", "state"), ("index", "clip")]
        self.out_keys = policy.out_keys

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Look up the features, and apply the policy to them."""
        shown = self.features(tensordict["index", "state"], tensordict["index", "clip"])
        shown |= {key: tensordict[key] for key in self.in_keys if isinstance(key, str)}
        answer = self.policy(TensorDict(shown, batch_size=tensordict.batch_size))
        return tensordict.update(answer.select(*self.out_keys))
