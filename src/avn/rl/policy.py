"""What acts in an environment: features in, actions and memory out."""

from __future__ import annotations

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor

from avn.rl.environment import FeatureModule
from avn.rl.networks import ActorCritic, sample


class Policy(TensorDictModuleBase):
    """An actor-critic as a policy of TorchRL.

    Parameters
    ----------
    network : ActorCritic
    generator : torch.Generator
        Draws the actions.
    """

    def __init__(self, network: ActorCritic, generator: torch.Generator) -> None:
        super().__init__()
        self.network, self.generator = network, generator
        memory = ["h", "c"] if network.shape.memory else []
        self.in_keys = [*network.shape.inputs, *memory]
        self.out_keys = ["action", *(f"{name}_next" for name in memory)]

    @torch.no_grad()
    def choose(self, seen: dict[str, Tensor]) -> dict[str, Tensor]:
        """Actions (N,) for N observations, and what is remembered of them."""
        network = self.network
        embedding = network.embed({name: seen[name] for name in network.shape.inputs})
        if network.lstm is None:
            return {"action": sample(network.actor(embedding), self.generator)}
        joint, h, c = network.remember(embedding, seen["h"], seen["c"])
        return {"action": sample(network.actor(joint), self.generator), "h_next": h, "c_next": c}

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Write action and memory into a TensorDict."""
        seen = {name: tensordict[name] for name in self.in_keys}
        return tensordict.update(self.choose(seen))


class FeatureLookup(TensorDictModuleBase):
    """A policy behind the environment's feature module: it is shown features and no numbers.

    Parameters
    ----------
    features : FeatureModule
    policy : TensorDictModuleBase
    """

    def __init__(self, features: FeatureModule, policy: TensorDictModuleBase) -> None:
        super().__init__()
        self.features, self.policy = features, policy
        resolved = {*features.seen, *features.heard}
        self.in_keys = [key for key in policy.in_keys if key not in resolved]
        self.in_keys += [("index", "state"), ("index", "clip")]
        self.out_keys = policy.out_keys

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Let the policy act on what the numbers stand for."""
        shown = self.features(tensordict["index", "state"], tensordict["index", "clip"])
        shown |= {key: tensordict[key] for key in self.in_keys if isinstance(key, str)}
        answer = self.policy(TensorDict(shown, batch_size=tensordict.batch_size))
        return tensordict.update(answer.select(*self.out_keys))
