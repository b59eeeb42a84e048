"""Random walk: any of the protocol's actions, all with the same chance."""

from __future__ import annotations

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent


class RandomWalk(Agent):
    """Draws uniformly from all actions of the protocol; Stop is one of them where there is one."""

    def act(self, observation: TensorDict) -> Tensor:
        """One draw for every episode."""
        return torch.randint(self.protocol.actions, (self.n,), generator=self.generator)
