"""Grid of an apartment: free cells, moves between them, shortest paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import shortest_path

from avn.apartments.floor_plan import CELL, FloorPlan
from avn.apartments.walls import obstacles
from avn.core.errors import UserError

BODY_RADIUS = 0.2
# North, east, south, west in lattice steps (x, y).
STEPS = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)], dtype=np.int32)
# Tolerance, so that a disc that just touches is blocked regardless of rounding.
_TOUCH = 1e-9


@dataclass(frozen=True)
class Grid:
    """C free cells and the moves between them.

    Attributes
    ----------
    lattice : (C, 2) int32
        Lattice indices (x, y); the centre of a cell is 0.5 times that, in metres. Cells are
        numbered from south to north and, within a row, from west to east.
    neighbours : (C, 4) int32
        The cell that a move to the north, east, south, west leads to, or -1.
    distances : (C, C) int16
        Length of the shortest path between two cells, in moves.
    rooms : (C,) int16
        Index into `plan.rooms`; a cell in a doorway belongs to the room with the lower index.
    squares : int
        Number of grid squares inside the rooms and in doorways, occupied ones included.
    """

    lattice: NDArray[np.int32]
    neighbours: NDArray[np.int32]
    distances: NDArray[np.int16]
    rooms: NDArray[np.int16]
    squares: int

    @property
    def centres(self) -> NDArray[np.float64]:
        """Centres of the cells, (C, 2) float64, metres."""
        return self.lattice * np.float64(CELL)

    @property
    def cells(self) -> int:
        """Number of free cells."""
        return len(self.lattice)


def squares_of(plan: FloorPlan) -> tuple[NDArray[np.int32], NDArray[np.int16]]:
    """List the lattice squares within the rooms and in the doorways, free or not.

    Returns
    -------
    lattice : (S, 2) int32
        Sorted from south to north, then from west to east.
    rooms : (S,) int16
        Room of each; for a doorway the lower index of the two rooms it joins.
    """
    points: list[NDArray[np.int64]] = []
    owners: list[NDArray[np.int64]] = []
    bounds = np.array([(r.x0, r.y0, r.x1, r.y1) for r in plan.rooms]).reshape(-1, 4)
    for index, (x0, y0, x1, y1) in enumerate(np.rint(bounds / CELL).astype(int)):
        inside = np.stack(np.meshgrid(np.arange(x0 + 1, x1), np.arange(y0 + 1, y1)), -1)
        points.append(inside.reshape(-1, 2))
        owners.append(np.full(len(points[-1]), index))
    for door in plan.doorways:
        at = np.array([door.x, door.y])
        beside = (bounds[:, :2] <= at + 1e-6) & (at - 1e-6 <= bounds[:, 2:])
        joined = np.flatnonzero(beside.all(axis=1))
        if not len(joined):
            raise UserError(
                f"floor plan {plan.name}: the doorway at ({door.x}, {door.y}) is in no wall; "
                "move it onto the line between two rooms"
            )
        points.append(np.rint(at / CELL).astype(int)[None])
        owners.append(joined[:1])
    if not points:
        raise UserError(f"floor plan {plan.name}: it has no room; give it at least one")
    lattice, owner = np.concatenate(points).astype(np.int32), np.concatenate(owners)
    order = np.lexsort((lattice[:, 0], lattice[:, 1]))
    return lattice[order], owner[order].astype(np.int16)


def touches(
    low: NDArray[np.float64], high: NDArray[np.float64], boxes: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Test a disc of 0.2 m, swept from `low` to `high`, for contact with any box.

    Parameters
    ----------
    low, high : (N, 2) float64
        Ends of axis-aligned segments, `low` <= `high`, metres; equal ends for a disc at rest.
    boxes : (B, 4) float64
        Obstacles x0, y0, x1, y1, metres.

    Returns
    -------
    (N,) bool
        True where the disc touches a box.
    """
    gap = np.maximum(boxes[None, :, :2] - high[:, None], low[:, None] - boxes[None, :, 2:])
    distance = np.hypot(*np.moveaxis(np.maximum(gap, 0.0), -1, 0))
    return (distance <= BODY_RADIUS + _TOUCH).any(axis=1)


def free_squares(
    lattice: NDArray[np.int32], boxes: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.int32]]:
    """Find the free squares among obstacles, and their neighbours.

    Parameters
    ----------
    lattice : (S, 2) int32
        Lattice indices of the squares.
    boxes : (B, 4) float64
        Obstacles x0, y0, x1, y1, metres.

    Returns
    -------
    free : (S,) bool
        True for free squares, F in all.
    neighbours : (F, 4) int32
        Index among the free squares to the north, east, south and west, or -1.
    """
    centres = lattice * np.float64(CELL)
    free = ~touches(centres, centres, boxes)
    cells = lattice[free]
    neighbours = np.full((len(cells), 4), -1, dtype=np.int32)
    if not len(cells):
        return free, neighbours
    origin, size = cells.min(axis=0) - 1, np.ptp(cells, axis=0) + 3
    number = np.full(size, -1, dtype=np.int32)
    number[tuple((cells - origin).T)] = np.arange(len(cells))
    for heading, step in enumerate(STEPS):
        target = number[tuple((cells + step - origin).T)]
        from_, to = cells * np.float64(CELL), (cells + step) * np.float64(CELL)
        blocked = touches(np.minimum(from_, to), np.maximum(from_, to), boxes)
        neighbours[:, heading] = np.where(blocked, -1, target)
    return free, neighbours


def moves_between(neighbours: NDArray[np.int32]) -> NDArray[np.float64]:
    """Compute the shortest paths between all pairs in moves, (C, C); inf where there is none."""
    count = len(neighbours)
    start, heading = np.nonzero(neighbours >= 0)
    end = neighbours[start, heading]
    graph = csr_matrix((np.ones(len(start)), (start, end)), shape=(count, count))
    return np.asarray(shortest_path(graph, unweighted=True), dtype=np.float64)


def build_grid(plan: FloorPlan) -> Grid:
    """Find the free cells of a plan and the moves between them.

    A cell is free if a disc of 0.2 m around its centre touches neither wall nor furniture. A move
    is possible if the swept disc touches none.

    Raises
    ------
    UserError
        If no cell is free, the free cells are not connected, or a source of the plan is not on a
        free cell.
    """
    lattice, rooms = squares_of(plan)
    free, neighbours = free_squares(lattice, obstacles(plan))
    if not free.any():
        raise UserError(f"floor plan {plan.name}: no cell is free; take out furniture")
    distances = moves_between(neighbours)
    if not np.isfinite(distances).all():
        lost = lattice[free][int(np.isinf(distances[0]).argmax())] * CELL
        raise UserError(
            f"floor plan {plan.name}: the free cell at ({lost[0]:g}, {lost[1]:g}) cannot be "
            "reached from the others; move the furniture or add a doorway"
        )
    grid = Grid(
        lattice=lattice[free],
        neighbours=neighbours,
        distances=distances.astype(np.int16),
        rooms=rooms[free],
        squares=len(lattice),
    )
    source_cells(plan, grid)
    return grid


def source_cells(plan: FloorPlan, grid: Grid) -> NDArray[np.int32]:
    """Return the cells of the plan's sources, (K,) int32.

    Raises
    ------
    UserError
        If a source is not at the centre of a free cell.
    """
    points = np.array(plan.sources, dtype=np.float64).reshape(-1, 2)
    near = np.abs(points[:, None] - grid.centres[None]) < 1e-6
    hits: NDArray[np.bool_] = np.asarray(near.all(axis=2))
    for (x, y), hit in zip(points, hits, strict=True):
        if not hit.any():
            raise UserError(
                f"floor plan {plan.name}: the source at ({x:g}, {y:g}) is not on a free cell; "
                f"put it on one (multiples of {CELL} m)"
            )
    return hits.argmax(axis=1).astype(np.int32)


def goal_cells(grid: Grid) -> NDArray[np.bool_]:
    """Find the goal cells of a source on each cell: of 3 x 3 cells, those at most two moves away.

    Returns
    -------
    (C, C) bool
        Row s is True for the goal cells of a source on cell s.
    """
    offset = np.abs(grid.lattice[:, None] - grid.lattice[None]).max(axis=2)
    return np.asarray((offset <= 1) & (grid.distances <= 2))
