"""Actions, headings and states as numbers, and where each action leads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FORWARD, BACKWARD, ROTATE_LEFT, ROTATE_RIGHT, STOP = range(5)
MOVES = (FORWARD, BACKWARD)
ACTIONS = 5
HEADINGS = 4


def transitions(neighbours: NDArray[np.int32]) -> NDArray[np.int64]:
    """The state that each action leads to; a blocked move leads back to where it began.

    Parameters
    ----------
    neighbours : (C, 4) int
        The cell to the north, east, south and west, or -1.

    Returns
    -------
    (4 C, 5) int64
        By state (4 x cell + heading) and action. Backward keeps the heading.
    """
    cells = len(neighbours)
    own = np.arange(cells)[:, None]
    heading = np.arange(HEADINGS)[None, :]
    reached = np.where(neighbours >= 0, neighbours, own).astype(np.int64)
    behind = reached[:, (np.arange(HEADINGS) + 2) % HEADINGS]
    table = np.stack(
        (
            HEADINGS * reached + heading,
            HEADINGS * behind + heading,
            HEADINGS * own + (heading - 1) % HEADINGS,
            HEADINGS * own + (heading + 1) % HEADINGS,
            HEADINGS * own + heading,
        ),
        axis=-1,
    )
    return table.reshape(HEADINGS * cells, ACTIONS)
