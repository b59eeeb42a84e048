"""Squares that agents have searched without finding the source."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def rule_out(
    searched: NDArray[np.bool_],
    position: NDArray[np.int64],
    reach: int,
    rows: NDArray[np.bool_],
) -> None:
    """Mark the squares around agents as searched, in place.

    Parameters
    ----------
    searched : (N, M, M) bool
        Squares that do not hold the source, by row and column.
    position : (N, 2) int64
        Column and row of the agents.
    reach : int
        Squares around the agent, including diagonals.
    rows : (N,) bool
        Agents to update.
    """
    chosen = np.flatnonzero(rows)
    size = searched.shape[1]
    around = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), -1).reshape(-1, 2)
    squares = np.clip(position[chosen, None] + around, 0, size - 1)
    searched[chosen[:, None], squares[..., 1], squares[..., 0]] = True
