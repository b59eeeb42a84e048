"""Random positions of sound sources."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import Grid, goal_cells
from avn.core.errors import UserError
from avn.core.random import Rng

# Least distance between two sources where cells allow it, metres.
APART = 1.5
# Wanted number of goal cells of a source, out of nine.
_OPEN = 8


def spread_sources(plan: FloorPlan, grid: Grid, count: int, rng: Rng) -> list[tuple[float, float]]:
    """Draw cells for sources: in every room if there are enough, far from one another.

    Most of the 3 x 3 cells around a source are free, so that walls and not narrow niches make an
    episode hard. Cells in a doorway, or next to one, are left out.

    Parameters
    ----------
    plan : FloorPlan
        The apartment.
    grid : Grid
        Its cells.
    count : int
        Number of sources.
    rng : Generator or Draws
        Random numbers.

    Returns
    -------
    list of (x, y)
        Centres of `count` free cells, metres, in ascending order of the cell's index.

    Raises
    ------
    UserError
        If the apartment has fewer such cells than `count`.
    """
    doors = np.array([(d.x, d.y) for d in plan.doorways]).reshape(-1, 2)
    away = np.abs(grid.centres[:, None] - doors[None]).max(axis=2, initial=0) > 0.6
    eligible = np.flatnonzero(away.all(axis=1))
    if len(eligible) < count:
        raise UserError(
            f"apartment {plan.name}: {count} sources asked for, room for {len(eligible)}; "
            "ask for fewer"
        )
    openness = goal_cells(grid).sum(axis=1)
    chosen: list[int] = []
    for room in _rooms_for_sources(plan, grid.rooms[eligible], count):
        cells = eligible[grid.rooms[eligible] == room]
        cells = cells[~np.isin(cells, chosen)]
        chosen.append(_choose(cells, chosen, grid, openness, rng))
    return [(float(x), float(y)) for x, y in grid.centres[sorted(chosen)]]


def _rooms_for_sources(plan: FloorPlan, rooms: NDArray[np.int16], count: int) -> list[int]:
    """Return the room of each source: one in every room first, then by the rooms' cells.

    A bathroom is left out of the first round unless there are two sources for every room.
    """
    cells = np.bincount(rooms, minlength=len(plan.rooms))
    small = np.array([room.kind == "bathroom" for room in plan.rooms])
    first = (cells > 0) & (~small | (count >= 2 * len(plan.rooms)))
    given = np.zeros(len(cells), dtype=int)
    for _ in range(count):
        # The room with most cells for each source, among those with a cell left.
        share = np.where(given < cells, cells / (given + 1), -1.0)
        waiting = first & (given == 0)
        given[int(np.where(waiting, share, share * ~waiting.any()).argmax())] += 1
    return [room for room, n in enumerate(given) for _ in range(n)]


def _choose(
    cells: NDArray[np.int64],
    chosen: list[int],
    grid: Grid,
    openness: NDArray[np.int64],
    rng: Rng,
) -> int:
    """Draw a cell far enough from the chosen ones and with free cells around it, if any."""
    nearest = np.full(len(cells), np.inf)
    if chosen:
        apart = np.linalg.norm(grid.centres[cells][:, None] - grid.centres[chosen][None], axis=2)
        nearest = apart.min(axis=1)
    far = nearest >= APART if (nearest >= APART).any() else nearest == nearest.max()
    cells = cells[far]
    wanted = min(_OPEN, openness[cells].max())
    return int(rng.choice(cells[openness[cells] >= wanted].tolist()))
