"""Random agent, which draws actions uniformly."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

from avn.agents.base import Agent

if TYPE_CHECKING:
    from tensordict import TensorDict


class RandomWalk(Agent):
    """Agent that draws uniformly from all actions of the protocol, including Stop if it has one."""

    def act(self, observation: TensorDict) -> Tensor:
        """Draw an action for every episode. See `Agent.act`."""
        return torch.randint(self.protocol.actions, (self.n,), generator=self.generator)
