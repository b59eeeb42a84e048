"""Source that walks through the apartment, and the earliest time at which it can be caught."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.grid import Grid
from avn.core.errors import UserError
from avn.core.random import scramble, uniform
from avn.navigation.distances import actions_to_cells


class Motion:
    """Walk of a source along shortest paths to random squares.

    The walk is that of Younes, Honerkamp, Welschehold and Valada, "Catch Me If You Hear Me:
    Audio-Visual Navigation in Complex Unmapped Environments with Moving Sounds" (2022). It begins
    at the place of the source. Its ends are drawn uniformly from the other free squares of the
    apartment, one after another; of several shortest paths, it takes the one that goes to the
    north, east, south and west first, in this order.

    Parameters
    ----------
    step : float
        Probability that the source goes on to the next square during an action, 0 to 1.

    Raises
    ------
    UserError
        If the probability is out of range.
    """

    def __init__(self, step: float = 0.3) -> None:
        if not 0 <= step <= 1:
            raise UserError(f"motion.step: {step}; give a probability, 0 to 1")
        self.step = step

    def walk(
        self, keys: NDArray[np.uint64], cells: NDArray[np.int32], grid: Grid, actions: int
    ) -> NDArray[np.int16]:
        """Return the cell of N sources after each number of actions, (N, actions + 1).

        Parameters
        ----------
        keys : (N,) uint64
            Key of each episode's random numbers.
        cells : (N,) int
            Cells in which the walks begin.
        grid : Grid
            Cells with their neighbours and distances.
        actions : int
            Number of actions.
        """
        found = np.empty((len(cells), actions + 1), dtype=np.int16)
        here = end = found[:, 0] = cells
        for number in range(actions):
            others = np.uint64(max(grid.cells - 1, 1))
            away = 1 + (scramble(keys, 2 * number) % others).astype(np.int64)
            end = np.where(end == here, (here + away) % grid.cells, end)
            ahead = grid.neighbours[here]
            left = grid.distances[end[:, None], ahead] - grid.distances[end, here][:, None]
            closer = (ahead >= 0) & (left < 0)
            steps = (uniform(keys, 2 * number + 1) < self.step) & closer.any(axis=1)
            here = np.where(steps, ahead[np.arange(len(here)), closer.argmax(axis=1)], here)
            found[:, number + 1] = here
        return found


def earliest_catch(
    grid: Grid, goal: NDArray[np.bool_], walk: NDArray[np.int16], start: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Compute the fewest actions after which an agent can be at the goal of a moving source.

    The agent knows the walk. It turns where it has to wait, so it can be in a cell after any
    number of actions that is no less than the fewest.

    Parameters
    ----------
    grid : Grid
        Cells and the moves between them.
    goal : (C, C) bool
        Goal cells of a source in each cell.
    walk : (N, T + 1) int
        Cell of the source after each number of actions; see `Motion.walk`.
    start : (N,) int64
        First state of each agent.

    Returns
    -------
    actions : (N,) int64
        Fewest actions; T + 1 where T actions are not enough.
    cell : (N,) int64
        Cell in which the agent is then; without meaning where T actions are not enough.
    """
    to_cells = actions_to_cells(grid.neighbours, np.arange(grid.cells, dtype=np.int32))
    beyond = walk.shape[1] + to_cells.max()
    actions, cell = np.empty((2, len(start)), dtype=np.int64)
    for row, (places, state) in enumerate(zip(walk, start, strict=True)):
        to_goal = np.where(goal, to_cells[:, state], beyond)
        caught = np.append(to_goal.min(axis=1)[places] <= np.arange(len(places)), True)
        actions[row] = caught.argmax()
        cell[row] = to_goal[places[min(actions[row], len(places) - 1)]].argmin()
    return actions, cell
