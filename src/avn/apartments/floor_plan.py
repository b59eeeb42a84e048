"""Floor plans of apartments, in metres, and their JSON format.

The centres of the lattice's cells are at (0.5 i, 0.5 j); walls are centred on lines of the
lattice, so that a wall blocks a whole line of cells. x points east, y north, z up.
Headings are 0 north, 1 east, 2 south, 3 west.
"""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from avn.core.errors import UserError

CELL = 0.5
WALL_THICKNESS = 0.1
DOOR_WIDTH = 0.9
DOOR_HEIGHT = 2.05
CEILING = 2.6
ROOM_KINDS = ("kitchen", "bedroom", "living_room", "bathroom")
FORMAT_VERSION = 1
FARTHEST = 1000.0  # metres


@dataclass(frozen=True)
class Room:
    """A rectangular room; the bounds are the centre lines of its walls, on the lattice."""

    kind: str
    x0: float
    y0: float
    x1: float
    y1: float
    floor: str
    walls: str
    ceiling: str


@dataclass(frozen=True)
class Doorway:
    """A gap of 0.9 m in a wall; its centre (x, y) in metres is a lattice cell on the wall's line.

    `along` is the axis that the wall is parallel to, "x" or "y".
    """

    x: float
    y: float
    along: str


@dataclass(frozen=True)
class Window:
    """A window in an outer wall: centre, axis of the wall, width, height of the sill, height.

    Lengths are in metres.
    """

    x: float
    y: float
    along: str
    width: float
    sill: float
    height: float


@dataclass(frozen=True)
class Piece:
    """A piece of furniture: its kind, centre, heading and bounding box, in metres.

    `depth` is measured in the direction of the heading and `width` across it, so that with
    heading 1 or 3 the width is along y. `z` is the height of its underside above the floor.
    """

    kind: str
    x: float
    y: float
    width: float
    depth: float
    height: float
    heading: int
    material: str
    z: float = 0.0

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Footprint (x0, y0, x1, y1) in metres."""
        half_x, half_y = self.width / 2, self.depth / 2
        if self.heading % 2:
            half_x, half_y = half_y, half_x
        return self.x - half_x, self.y - half_y, self.x + half_x, self.y + half_y


@dataclass(frozen=True)
class Lamp:
    """A lamp at a point of a room, metres."""

    x: float
    y: float
    z: float


@dataclass(frozen=True)
class FloorPlan:
    """An apartment: rooms, openings, furniture, lamps and positions of sources.

    `sources` are (x, y) centres of free cells, in metres.
    """

    name: str
    rooms: tuple[Room, ...]
    doorways: tuple[Doorway, ...]
    windows: tuple[Window, ...] = ()
    furniture: tuple[Piece, ...] = ()
    lamps: tuple[Lamp, ...] = ()
    sources: tuple[tuple[float, float], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Convert the plan to lists and dicts, with the version of the format."""
        return {"format": FORMAT_VERSION, **dataclasses.asdict(self)}

    def to_json(self) -> str:
        """Convert the plan to JSON text; equal plans give equal bytes."""
        return json.dumps(self.to_dict(), indent=1, sort_keys=True) + "\n"


_PARTS = {
    "rooms": Room,
    "doorways": Doorway,
    "windows": Window,
    "furniture": Piece,
    "lamps": Lamp,
}


def from_dict(data: dict[str, Any], origin: str = "floor plan") -> FloorPlan:
    """Build a plan from the result of `FloorPlan.to_dict`.

    Parameters
    ----------
    data : dict
        Lists and dicts, as read from JSON.
    origin : str
        Name of the file, for messages.

    Raises
    ------
    UserError
        If a key is missing, unknown or of another type, or the plan is not valid.
    """
    if not isinstance(data, dict) or data.get("format") != FORMAT_VERSION:
        raise UserError(
            f"{origin}: not a floor plan of format {FORMAT_VERSION}, the one of this version; "
            "see docs/dataset.md"
        )
    known = ("format", "name", "sources", *_PARTS)
    for key in known:
        if key not in data:
            raise UserError(f"{origin}: key '{key}' is missing; see docs/dataset.md")
    for key in data:
        if key not in known:
            raise UserError(f"{origin}: unknown key '{key}'; there are {', '.join(known)}")
    for key in (*_PARTS, "sources"):
        if not isinstance(data[key], list | tuple):
            raise UserError(f"{origin}: '{key}' is no list; see docs/dataset.md")
    for point in data["sources"]:
        if not isinstance(point, list | tuple) or [_number(v) for v in point] != [True, True]:
            raise UserError(f"{origin}: a source is {point!r}, not [x, y] in metres")
    plan = FloorPlan(
        name=str(data["name"]),
        sources=tuple((float(x), float(y)) for x, y in data["sources"]),
        **{
            key: tuple(
                _part(cls, item, f"{origin}: {key}[{i}]") for i, item in enumerate(data[key])
            )
            for key, cls in _PARTS.items()
        },
    )
    _check(plan, origin)
    return plan


def load(path: Path) -> FloorPlan:
    """Read a plan from a JSON file; raise `UserError` with the file's name for a bad one."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}; give the path of a floor plan") from error
    except ValueError as error:
        raise UserError(f"{path}: not JSON ({error}); give the path of a floor plan") from error
    return from_dict(data, str(path))


def _part(cls: type, data: Any, where: str) -> Any:
    """Build one part of a plan, such as a room, from its JSON object.

    Raises
    ------
    UserError
        If a key is missing, unknown or of another type; the message names the part and the key.
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
            fits = _number(data[key]) and (field.type != "int" or int(data[key]) == data[key])
        if not fits:
            raise UserError(f"{where}: '{key}' is {data[key]!r}, which is no {field.type}")
    return cls(**data)


def _number(value: Any) -> bool:
    """Return True for a finite number of at most `FARTHEST` metres."""
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and math.isfinite(value)
        and abs(value) <= FARTHEST
    )


def _check(plan: FloorPlan, origin: str) -> None:
    """Raise `UserError` if rooms, openings, furniture or sources are not valid."""

    def on_lattice(*values: float) -> bool:
        return all(math.isclose(v / CELL, round(v / CELL), abs_tol=1e-6) for v in values)

    if not plan.rooms or not plan.sources:
        missing = "sources" if plan.rooms else "rooms"
        raise UserError(f"{origin}: {missing} is empty; a floor plan has at least one")
    for room in plan.rooms:
        if room.kind not in ROOM_KINDS:
            raise UserError(f"{origin}: room kind '{room.kind}' is none of {', '.join(ROOM_KINDS)}")
        if not on_lattice(room.x0, room.y0, room.x1, room.y1):
            raise UserError(f"{origin}: walls of the {room.kind} are not on the {CELL} m lattice")
        if room.x1 <= room.x0 or room.y1 <= room.y0:
            raise UserError(f"{origin}: the {room.kind} has no area; x0 < x1 and y0 < y1 must hold")
    openings: list[Doorway | Window] = [*plan.doorways, *plan.windows]
    for opening in openings:
        if opening.along not in ("x", "y"):
            raise UserError(f"{origin}: 'along' is '{opening.along}', not 'x' or 'y'")
    for door in plan.doorways:
        if not on_lattice(door.x, door.y):
            raise UserError(
                f"{origin}: the doorway at ({door.x}, {door.y}) is not centred on the {CELL} m "
                "lattice; move it"
            )
    for window in plan.windows:
        if min(window.width, window.height) <= 0 or not 0 <= window.sill < CEILING:
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
