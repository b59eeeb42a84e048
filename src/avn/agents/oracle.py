"""Oracle: the best walk by the true map, a bound on what any agent can reach."""

from __future__ import annotations

import torch
from tensordict import TensorDict
from torch import Tensor

from avn.agents.base import Agent
from avn.core.actions import ACTIONS, HEADINGS, MOVES, STOP
from avn.navigation.distances import fewest_actions
from avn.navigation.simulator import Simulator


class Oracle(Agent):
    """Takes a shortest walk to the goal, with the fewest turns of all such walks.

    It is shown map, source and state. SPL never loses by its walk, since it takes no more moves
    than the l of the protocol, and of these walks it takes the one with the fewest actions.
    """

    privileged = True

    def reveal(self, simulator: Simulator) -> None:
        """Take in the true map."""
        self._simulator = simulator
        distances, source = simulator.distances, simulator.episodes.source
        allowance = distances.allowance[source, simulator.episodes.start // HEADINGS]
        costs = fewest_actions(
            simulator.place.grid.neighbours, distances.goal, int(allowance.max())
        )
        self._allowance = torch.from_numpy(allowance)
        self._costs = torch.from_numpy(costs)
        self._goal = torch.from_numpy(distances.goal)

    def act(self, observation: TensorDict) -> Tensor:
        """The action after which the fewest are left."""
        simulator = self._simulator
        following = simulator.tables.following.unflatten(0, (-1, ACTIONS))
        after = following[simulator.state, :STOP]
        spent = torch.zeros(STOP, dtype=torch.int64)
        spent[list(MOVES)] = 1
        left = (self._allowance - simulator.walked)[:, None] - spent
        costs = self._costs[left.clamp(min=0), simulator.source[:, None], after].long()
        # A move that the allowance no longer holds is out; of equal costs the first action counts.
        costs = torch.where(left < 0, costs.max() + 1, costs)
        actions = (costs * STOP + torch.arange(STOP)).argmin(dim=1)
        if self.protocol.requires_stop:
            arrived = self._goal[simulator.source, simulator.state // HEADINGS]
            actions = torch.where(arrived, STOP, actions)
        return actions
