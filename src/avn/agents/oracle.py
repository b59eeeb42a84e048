"""Oracle agent, which follows a shortest path on the true map; an upper bound."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from avn.agents.base import Agent
from avn.core.actions import ACTIONS, HEADINGS, MOVES, ROTATE_LEFT, STOP
from avn.navigation.distances import actions_to_cells, fewest_actions
from avn.navigation.motion import earliest_catch
from avn.navigation.simulator import Simulator

if TYPE_CHECKING:
    from tensordict import TensorDict


class Oracle(Agent):
    """Agent that takes a shortest path to the goal, with the fewest turns of all such paths.

    It is given the true map, source and state. It takes no more moves than the l of SPL, and the
    fewest actions of all such paths. Of a moving source it is given the whole walk: it goes to the
    cell where the source can be caught first, and turns there until the source comes.
    """

    privileged = True

    def set_ground_truth(self, simulator: Simulator) -> None:
        """Compute the fewest actions on the true map. See `Agent.set_ground_truth`."""
        self._simulator = simulator
        grid, walk = simulator.scene.grid, simulator.course.walk
        last, _ = simulator.to_source()
        self._goal = torch.from_numpy(last.goal)
        if walk is not None:
            _, cell = earliest_catch(grid, last.goal, walk.numpy(), simulator.episodes.start)
            self._meeting = torch.from_numpy(cell)
            every = np.arange(grid.cells, dtype=np.int32)
            self._to_cells = torch.from_numpy(actions_to_cells(grid.neighbours, every))
            return
        distances, source = simulator.distances, simulator.episodes.source
        allowance = distances.allowance[source, simulator.episodes.start // HEADINGS]
        costs = fewest_actions(grid.neighbours, distances.goal, int(allowance.max()))
        self._allowance = torch.from_numpy(allowance)
        self._costs = torch.from_numpy(costs)

    def act(self, observation: TensorDict) -> Tensor:
        """Choose the action after which the fewest actions are left. See `Agent.act`."""
        simulator = self._simulator
        following = simulator.tables.following.unflatten(0, (-1, ACTIONS))
        after = following[simulator.state, :STOP]
        actions = self._shortest(after) if simulator.course.walk is None else self._waiting(after)
        if self.protocol.requires_stop:
            _, place = simulator.to_source()
            arrived = self._goal[place, simulator.state // HEADINGS]
            actions = torch.where(arrived, STOP, actions)
        return actions

    def _shortest(self, after: Tensor) -> Tensor:
        """Choose by the states after each action, (N, 4), on the way to a source that stays."""
        simulator = self._simulator
        spent = torch.zeros(STOP, dtype=torch.int64)
        spent[list(MOVES)] = 1
        left = (self._allowance - simulator.moves)[:, None] - spent
        costs = self._costs[left.clamp(min=0), simulator.source[:, None], after].long()
        # Moves beyond the allowance are excluded; of equal costs the first action is taken.
        costs = torch.where(left < 0, costs.max() + 1, costs)
        return (costs * STOP + torch.arange(STOP)).argmin(dim=1)

    def _waiting(self, after: Tensor) -> Tensor:
        """Choose by the states after each action on the way to where the source will come."""
        costs = self._to_cells[self._meeting[:, None], after]
        there = self._simulator.state // HEADINGS == self._meeting
        return torch.where(there, ROTATE_LEFT, costs.argmin(dim=1))
