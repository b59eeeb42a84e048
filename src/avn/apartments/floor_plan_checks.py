"""Check of a floor plan of the user: the first fault, as an error that names the file."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

from avn.apartments.building_checks import (
    doorway_faults,
    gap_faults,
    overlap_faults,
    room_faults,
    window_faults,
)
from avn.apartments.floor_plan import CELL, FloorPlan
from avn.apartments.furnishing_checks import furniture_faults, lamp_faults, source_faults
from avn.apartments.grid import build_grid
from avn.core.errors import UserError

# In this order, since a check relies on those before it.
_CHECKS = (
    room_faults,
    overlap_faults,
    gap_faults,
    doorway_faults,
    window_faults,
    furniture_faults,
    lamp_faults,
    source_faults,
)


def check(plan: FloorPlan, origin: str) -> None:
    """Raise `UserError` for the first fault of a plan.

    Parameters
    ----------
    plan : FloorPlan
        The apartment.
    origin : str
        Name of the file, for the message.

    Raises
    ------
    UserError
        If rooms overlap or leave a gap, a doorway or window is in no wall, a room cannot be
        reached, furniture, a lamp or a source is misplaced, a kind or a material is unknown, or the
        free cells are not connected.
    """
    snapped = _snapped(plan)
    fault = next(chain.from_iterable(faults(snapped) for faults in _CHECKS), None)
    if fault is not None:
        raise UserError(f"{origin}: {fault}")
    try:
        build_grid(plan)
    except UserError as error:
        raise UserError(f"{origin}: {error}") from error


def _snapped(plan: FloorPlan) -> FloorPlan:
    """Return a plan with the lines of rooms and doorways exactly on the lattice if they nearly are.

    The result of a calculation, such as 3.5000000000000004, is then no fault.
    """

    def snap(value: float) -> float:
        nearest = round(value / CELL) * CELL
        return nearest if abs(value - nearest) < 1e-6 else value

    rooms = tuple(
        replace(r, x0=snap(r.x0), y0=snap(r.y0), x1=snap(r.x1), y1=snap(r.y1)) for r in plan.rooms
    )
    doorways = tuple(replace(d, x=snap(d.x), y=snap(d.y)) for d in plan.doorways)
    windows = tuple(
        replace(w, y=snap(w.y)) if w.along == "x" else replace(w, x=snap(w.x)) for w in plan.windows
    )
    sources = tuple((snap(x), snap(y)) for x, y in plan.sources)
    return replace(plan, rooms=rooms, doorways=doorways, windows=windows, sources=sources)
