"""An agent of one's own: turns to where it hears the source, and to the right where it bumps."""

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent
from avn.core.actions import FORWARD, ROTATE_LEFT, ROTATE_RIGHT


class RightHand(Agent):
    needs = ("source_estimate",)

    def act(self, observation: TensorDict) -> Tensor:
        right, front = observation["source_estimate"].unbind(dim=-1)
        turn = torch.where(right < 0, ROTATE_LEFT, ROTATE_RIGHT)
        actions = torch.where((front > 0) & (front >= right.abs()), FORWARD, turn)
        return torch.where(observation["collided"], ROTATE_RIGHT, actions)
