"""Oracle agent, which follows a shortest path on the true map; an upper bound."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

from avn.agents.base import Agent
from avn.core.actions import ACTIONS, HEADINGS, MOVES, STOP
from avn.navigation.distances import fewest_actions
from avn.navigation.simulator import Simulator

if TYPE_CHECKING:
    from tensordict import TensorDict


class Oracle(Agent):
    """Agent that takes a shortest path to the goal, with the fewest turns of all such paths.

    It is given the true map, source and state. It takes no more moves than the l of SPL, and the
    fewest actions of all such paths.
    """

    privileged = True

    def set_ground_truth(self, simulator: Simulator) -> None:
        """Compute the fewest actions on the true map. See `Agent.set_ground_truth`."""
        self._simulator = simulator
        distances, source = simulator.distances, simulator.episodes.source
        allowance = distances.allowance[source, simulator.episodes.start // HEADINGS]
        costs = fewest_actions(
            simulator.scene.grid.neighbours, distances.goal, int(allowance.max())
        )
        self._allowance = torch.from_numpy(allowance)
        self._costs = torch.from_numpy(costs)
        self._goal = torch.from_numpy(distances.goal)

    def act(self, observation: TensorDict) -> Tensor:
        """Choose the action after which the fewest actions are left. See `Agent.act`."""
        simulator = self._simulator
        following = simulator.tables.following.unflatten(0, (-1, ACTIONS))
        after = following[simulator.state, :STOP]
        spent = torch.zeros(STOP, dtype=torch.int64)
        spent[list(MOVES)] = 1
        left = (self._allowance - simulator.moves)[:, None] - spent
        costs = self._costs[left.clamp(min=0), simulator.source[:, None], after].long()
        # Moves beyond the allowance are excluded; of equal costs the first action is taken.
        costs = torch.where(left < 0, costs.max() + 1, costs)
        actions = (costs * STOP + torch.arange(STOP)).argmin(dim=1)
        if self.protocol.requires_stop:
            arrived = self._goal[simulator.source, simulator.state // HEADINGS]
            actions = torch.where(arrived, STOP, actions)
        return actions
