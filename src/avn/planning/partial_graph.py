"""Partial graph: the knowledge of N agents about the squares around them, as nodes and edges.

The nodes are squares of a map, and edges join neighbours. Unknown squares count as free, unless the
rules say otherwise; a blocked square has no node and no edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.core.errors import UserError


@dataclass(frozen=True)
class GraphRules:
    """Rules that turn the probabilities of a map into nodes and costs.

    Attributes
    ----------
    obstacle_threshold : float
        Squares whose probability of being free is below this are no nodes, 0 to 1. Unknown squares
        have probability 0.5: above 0.5 they are no nodes.
    collision_cost : float
        Cost of a collision, moves, 0 to 1000. Entering a square that is free with probability p
        costs 1 + `collision_cost` (1 - p).

    Raises
    ------
    UserError
        If a setting is out of range.
    """

    obstacle_threshold: float = 0.5
    collision_cost: float = 0.0

    def __post_init__(self) -> None:
        """Check the settings."""
        if not 0 <= self.obstacle_threshold <= 1:
            raise UserError(f"planner.obstacle_threshold: {self.obstacle_threshold}; give 0 to 1")
        if not 0 <= self.collision_cost <= 1000:
            raise UserError(f"planner.collision_cost: {self.collision_cost}; give moves, 0 to 1000")


class PartialGraph:
    """Nodes and edges of N agents on M x M squares each.

    Parameters
    ----------
    n, size : int
        N and M.
    rules : GraphRules
        Threshold and costs.

    Attributes
    ----------
    cost : (N, M, M) float32
        Cost of entering a square, moves; infinite without a node. By square to the front and
        square to the right.
    walls : (N, M, M) uint8
        Bit h is set if there is no edge along heading h.
    """

    def __init__(self, n: int, size: int, rules: GraphRules) -> None:
        self.rules = rules
        unknown = np.inf if rules.obstacle_threshold > 0.5 else 1 + 0.5 * rules.collision_cost
        self.cost: NDArray[np.float32] = np.full((n, size, size), unknown, dtype=np.float32)
        self.walls: NDArray[np.uint8] = np.zeros((n, size, size), dtype=np.uint8)

    def set(self, squares: Tensor, belief: Tensor, rows: Tensor | None = None) -> None:
        """Set the costs of some squares from the probability that they are free.

        Parameters
        ----------
        squares : (N, k) int64 tensor
            Flat indices of squares of each agent's map.
        belief : (N, k) float32 tensor
            Probability that they are free.
        rows : (N,) int64 tensor, optional
            Numbers of the agents; all by default.
        """
        costs = 1 + self.rules.collision_cost * (1 - belief)
        costs = torch.where(belief < self.rules.obstacle_threshold, torch.inf, costs)
        flat = self.cost.reshape(len(self.cost), -1)
        chosen = np.arange(len(flat)) if rows is None else rows.numpy()
        flat[chosen[:, None], squares.numpy()] = costs.numpy()
