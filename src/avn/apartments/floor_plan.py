"""The floor plan: what is built, in metres, from which everything else is derived.

The lattice of cells has its centres at (0.5 i, 0.5 j); walls are centred on lines of the
lattice, so that a wall blocks a whole line of cells. x grows east, y north, z up.
Headings are 0 north, 1 east, 2 south, 3 west.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from avn.apartments.plan_checks import check, number, part
from avn.errors import UserError

CELL = 0.5
WALL_THICKNESS = 0.1
DOOR_WIDTH = 0.9
DOOR_HEIGHT = 2.05
CEILING = 2.6
ROOM_KINDS = ("kitchen", "bedroom", "living_room", "bathroom")
FORMAT_VERSION = 1


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
    """A gap of 0.9 m in a wall; the centre is a lattice cell on the wall's line.

    `along` is the axis that the wall runs along, "x" or "y".
    """

    x: float
    y: float
    along: str


@dataclass(frozen=True)
class Window:
    """A pane in an outer wall: centre, axis of the wall, width, sill height and own height."""

    x: float
    y: float
    along: str
    width: float
    sill: float
    height: float


@dataclass(frozen=True)
class Piece:
    """A piece of furniture: its kind, centre, heading and the box it fills.

    `width` is measured across the way it faces and `depth` along it, so that with heading
    1 or 3 the width lies along y. `z` is the height of its underside above the floor.
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
        """The footprint (x0, y0, x1, y1) in metres."""
        half_x, half_y = self.width / 2, self.depth / 2
        if self.heading % 2:
            half_x, half_y = half_y, half_x
        return self.x - half_x, self.y - half_y, self.x + half_x, self.y + half_y


@dataclass(frozen=True)
class Lamp:
    """A lamp at a point of a room."""

    x: float
    y: float
    z: float


@dataclass(frozen=True)
class FloorPlan:
    """An apartment: rooms, openings, furniture, lamps and the places where sources stand.

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
        """The plan as plain lists and dicts, with the version of the format."""
        return {"format": FORMAT_VERSION, **dataclasses.asdict(self)}

    def to_json(self) -> str:
        """The plan as JSON text; equal plans give equal bytes."""
        return json.dumps(self.to_dict(), indent=1, sort_keys=True) + "\n"


_PARTS = {
    "rooms": Room,
    "doorways": Doorway,
    "windows": Window,
    "furniture": Piece,
    "lamps": Lamp,
}


def from_dict(data: dict[str, Any], origin: str = "floor plan") -> FloorPlan:
    """Build a plan from what `FloorPlan.to_dict` gives.

    Raises
    ------
    UserError
        Where a key is missing, unknown or of another kind; `origin` names the file.
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
    for place in data["sources"]:
        if not isinstance(place, list | tuple) or [number(v) for v in place] != [True, True]:
            raise UserError(f"{origin}: a source is {place!r}, not [x, y] in metres")
    plan = FloorPlan(
        name=str(data["name"]),
        sources=tuple((float(x), float(y)) for x, y in data["sources"]),
        **{
            key: tuple(part(cls, own, f"{origin}: {key}[{i}]") for i, own in enumerate(data[key]))
            for key, cls in _PARTS.items()
        },
    )
    check(plan, origin, CELL, CEILING, ROOM_KINDS)
    return plan


def load(path: Path) -> FloorPlan:
    """Read a plan from a JSON file; raises `UserError` with the file's name."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}; give the path of a floor plan") from error
    except ValueError as error:
        raise UserError(f"{path}: not JSON ({error}); give the path of a floor plan") from error
    return from_dict(data, str(path))
