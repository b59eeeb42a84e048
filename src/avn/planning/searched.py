"""Squares that agents have searched without finding the source."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Searched:
    """Base class of beliefs of N agents about the source, on M x M squares each.

    Parameters
    ----------
    n, size : int
        N and M.

    Attributes
    ----------
    searched : (N, M, M) bool
        Squares that do not hold the source, by row and column.
    """

    def __init__(self, n: int, size: int) -> None:
        self.searched = np.zeros((n, size, size), dtype=np.bool_)

    def rule_out(self, position: NDArray[np.int64], reach: int, rows: NDArray[np.bool_]) -> None:
        """Mark the squares around agents as searched.

        Parameters
        ----------
        position : (N, 2) int64
            Column and row of the agents.
        reach : int
            Squares around the agent, including diagonals.
        rows : (N,) bool
            Agents to update.
        """
        chosen = np.flatnonzero(rows)
        size = self.searched.shape[1]
        around = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), -1).reshape(-1, 2)
        squares = np.clip(position[chosen, None] + around, 0, size - 1)
        self.searched[chosen[:, None], squares[..., 1], squares[..., 0]] = True
