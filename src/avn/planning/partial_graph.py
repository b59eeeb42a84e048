"""The partial graph: what N agents know of the squares round them, as nodes and edges.

The nodes are squares of a map, and an edge joins neighbours. Squares of which nothing is known
count as free; one that is found blocked loses its node, and with it its edges.
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
    """How beliefs become nodes and edges.

    Attributes
    ----------
    obstacle_threshold : float
        Squares that are believed to be free by less than this are no nodes; at most 0.5, so that
        unknown squares are.
    collision_cost : float
        Moves that running into a blocked square costs, so that entering a square that is free by
        p costs 1 + detour (1 - p).
    """

    obstacle_threshold: float = 0.5
    collision_cost: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.obstacle_threshold <= 0.5:
            raise UserError(
                f"planner.obstacle_threshold: {self.obstacle_threshold}; give 0 to 0.5, for an "
                "unknown square is believed to be free by 0.5 and must be a node"
            )
        if not 0 <= self.collision_cost <= 1000:
            raise UserError(f"planner.collision_cost: {self.collision_cost}; give moves, 0 to 1000")


class PartialGraph:
    """Nodes and edges of N agents on M x M squares.

    Parameters
    ----------
    n, size : int
    rules : GraphRules

    Attributes
    ----------
    cost : (N, M, M) float32
        What entering a square costs; infinite where there is no node. By square to the front and
        to the right.
    walls : (N, M, M) uint8
        Bit h is set where there is no edge along heading h.
    """

    def __init__(self, n: int, size: int, rules: GraphRules) -> None:
        self.rules = rules
        self.cost: NDArray[np.float32] = np.full(
            (n, size, size), 1 + 0.5 * rules.collision_cost, dtype=np.float32
        )
        self.walls: NDArray[np.uint8] = np.zeros((n, size, size), dtype=np.uint8)

    def set(self, squares: Tensor, belief: Tensor, rows: Tensor | None = None) -> None:
        """Give squares the cost that follows from what is believed of them.

        Parameters
        ----------
        squares : (N, k) int64 tensor
            Squares of each agent's map, laid out flat.
        belief : (N, k) float32 tensor
            Probability that they are free.
        rows : (N,) int64 tensor, optional
            Whose maps, where not those of all agents.
        """
        costs = 1 + self.rules.collision_cost * (1 - belief)
        costs = torch.where(belief < self.rules.obstacle_threshold, torch.inf, costs)
        flat = self.cost.reshape(len(self.cost), -1)
        chosen = np.arange(len(flat)) if rows is None else rows.numpy()
        flat[chosen[:, None], squares.numpy()] = costs.numpy()
