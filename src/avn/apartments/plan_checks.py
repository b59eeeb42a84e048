"""What a floor plan must fulfil to be one, said in a line where it does not."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

from avn.errors import UserError

if TYPE_CHECKING:
    from avn.apartments.floor_plan import Doorway, FloorPlan, Window

FARTHEST = 1000.0  # metres


def part(cls: type, data: Any, where: str) -> Any:
    """Build one part of a plan, such as a room, from what its JSON holds.

    Raises
    ------
    UserError
        Naming the part and the key that is missing, unknown or of another kind.
    """
    if not isinstance(data, dict):
        raise UserError(f"{where}: is {data!r}, not an object with keys; see docs/dataset.md")
    fields = {field.name: field for field in dataclasses.fields(cls)}
    for key in data:
        if key not in fields:
            raise UserError(f"{where}: unknown key '{key}'; there are {', '.join(fields)}")
    for key, field in fields.items():
        if key not in data:
            if field.default is dataclasses.MISSING:
                raise UserError(f"{where}: key '{key}' is missing; see docs/dataset.md")
            continue
        if field.type == "str":
            fits = isinstance(data[key], str)
        else:
            fits = number(data[key]) and (field.type != "int" or int(data[key]) == data[key])
        if not fits:
            raise UserError(f"{where}: '{key}' is {data[key]!r}, which is no {field.type}")
    return cls(**data)


def number(value: Any) -> bool:
    """Whether it is a number of metres within reach."""
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and math.isfinite(value)
        and abs(value) <= FARTHEST
    )


def check(
    plan: FloorPlan, origin: str, cell: float, ceiling: float, kinds: tuple[str, ...]
) -> None:
    """Raise `UserError` where rooms, openings, furniture or sources cannot be."""

    def on_lattice(*values: float) -> bool:
        return all(math.isclose(v / cell, round(v / cell), abs_tol=1e-6) for v in values)

    if not plan.rooms or not plan.sources:
        missing = "sources" if plan.rooms else "rooms"
        raise UserError(f"{origin}: {missing} is empty; a floor plan has at least one")
    for room in plan.rooms:
        if room.kind not in kinds:
            raise UserError(f"{origin}: room kind '{room.kind}' is none of {', '.join(kinds)}")
        if not on_lattice(room.x0, room.y0, room.x1, room.y1):
            raise UserError(f"{origin}: walls of the {room.kind} are not on the {cell} m lattice")
        if room.x1 <= room.x0 or room.y1 <= room.y0:
            raise UserError(f"{origin}: the {room.kind} has no area; x0 < x1 and y0 < y1 must hold")
    openings: list[Doorway | Window] = [*plan.doorways, *plan.windows]
    for opening in openings:
        if opening.along not in ("x", "y"):
            raise UserError(f"{origin}: 'along' is '{opening.along}', not 'x' or 'y'")
    for door in plan.doorways:
        if not on_lattice(door.x, door.y):
            raise UserError(
                f"{origin}: the doorway at ({door.x}, {door.y}) is not centred on the {cell} m "
                "lattice; move it"
            )
    for window in plan.windows:
        if min(window.width, window.height) <= 0 or not 0 <= window.sill < ceiling:
            raise UserError(
                f"{origin}: the window at ({window.x}, {window.y}) does not fit under the ceiling"
            )
    for piece in plan.furniture:
        if piece.heading not in (0, 1, 2, 3):
            raise UserError(f"{origin}: heading of a {piece.kind} is {piece.heading}, not 0 to 3")
        if min(piece.width, piece.depth, piece.height) <= 0 or piece.z < 0:
            raise UserError(
                f"{origin}: a {piece.kind} has no size; width, depth, height are over 0"
            )
    if len(set(plan.sources)) < len(plan.sources):
        raise UserError(f"{origin}: two sources stand in one place; move one")
