"""Actions, headings and states as integers, and the transitions between states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FORWARD, BACKWARD, ROTATE_LEFT, ROTATE_RIGHT, STOP = range(5)
MOVES = (FORWARD, BACKWARD)
ACTIONS = 5
HEADINGS = 4


def transitions(neighbours: NDArray[np.int32]) -> NDArray[np.int64]:
    """Compute the next state of each state and action; a blocked move keeps the state.

    Parameters
    ----------
    neighbours : (C, 4) int
        Index of the cell to the north, east, south and west, or -1.

    Returns
    -------
    (4 C, 5) int64
        By state (4 x cell + heading) and action. Backward keeps the heading.
    """
    cells = len(neighbours)
    cell = np.arange(cells)[:, None]
    heading = np.arange(HEADINGS)[None, :]
    reached = np.where(neighbours >= 0, neighbours, cell).astype(np.int64)
    behind = reached[:, (np.arange(HEADINGS) + 2) % HEADINGS]
    table = np.stack(
        (
            HEADINGS * reached + heading,
            HEADINGS * behind + heading,
            HEADINGS * cell + (heading - 1) % HEADINGS,
            HEADINGS * cell + (heading + 1) % HEADINGS,
            HEADINGS * cell + heading,
        ),
        axis=-1,
    )
    return table.reshape(HEADINGS * cells, ACTIONS)
