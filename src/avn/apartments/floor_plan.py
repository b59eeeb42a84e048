"""Floor plans of apartments, in metres, and their JSON format.

The centres of the lattice's cells are at (0.5 i, 0.5 j); walls are centred on lines of the
lattice, so that a wall blocks a whole line of cells. x points east, y north, z up.
Headings are 0 north, 1 east, 2 south, 3 west.
"""

from __future__ import annotations

import dataclasses
import json
import reprlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from avn.core.errors import UserError

CELL = 0.5
WALL_THICKNESS = 0.1
DOOR_WIDTH = 0.9
DOOR_HEIGHT = 2.05
CEILING = 2.6
ROOM_KINDS = ("kitchen", "bedroom", "living_room", "bathroom")
FURNITURE_KINDS = (
    "armchair",
    "basin",
    "bath_cabinet",
    "bathtub",
    "bed",
    "bookshelf",
    "chair",
    "coffee_table",
    "counter",
    "cupboard",
    "curtain",
    "desk",
    "dining_table",
    "dresser",
    "fridge",
    "front_door",
    "nightstand",
    "plant",
    "shower",
    "sideboard",
    "sink",
    "sofa",
    "stove",
    "television",
    "toilet",
    "tv_stand",
    "wardrobe",
    "washing_machine",
)
# Their acoustic coefficients are in `avn.acoustics.materials`.
MATERIALS = (
    "parquet",
    "carpet",
    "floor_tiles",
    "plaster",
    "painted_brick",
    "wall_tiles",
    "ceiling_plaster",
    "glass",
    "wood",
    "upholstery",
    "mattress",
    "laminate",
    "ceramic",
    "metal",
    "books",
    "fabric",
)
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
_SEE = "(docs/apartments.md lists all keys)"


def from_dict(data: Any, origin: str = "floor plan") -> FloorPlan:
    """Build a plan from the result of `FloorPlan.to_dict`.

    Keys and types are checked; `floor_plan_checks.check` tests whether the plan can be built.

    Parameters
    ----------
    data : dict
        Lists and dicts, as read from JSON.
    origin : str
        Name of the file, for messages.

    Raises
    ------
    UserError
        If a key is missing, unknown or of another type.
    """
    if not isinstance(data, dict) or data.get("format") != FORMAT_VERSION:
        raise UserError(
            f"{origin}: not a floor plan of format {FORMAT_VERSION}, the one of this version; "
            f"write an object with the key 'format': {FORMAT_VERSION} {_SEE}"
        )
    known = ("format", "name", "sources", *_PARTS)
    _check_keys(data, known, known, origin)
    if not isinstance(data["name"], str):
        raise UserError(f"{origin}: 'name' is {_short(data['name'])}; give text in quotes")
    for key in (*_PARTS, "sources"):
        if not isinstance(data[key], list | tuple):
            raise UserError(f"{origin}: '{key}' is {_short(data[key])}; give a list {_SEE}")
    for n, point in enumerate(data["sources"]):
        if not isinstance(point, list | tuple) or [_number(v) for v in point] != [True, True]:
            raise UserError(f"{origin}: sources[{n}] is {_short(point)}; give [x, y] in metres")
    return FloorPlan(
        name=data["name"],
        sources=tuple((float(x), float(y)) for x, y in data["sources"]),
        **{
            key: tuple(
                _part(cls, item, f"{origin}: {key}[{i}]") for i, item in enumerate(data[key])
            )
            for key, cls in _PARTS.items()
        },
    )


def _part(cls: type, data: Any, where: str) -> Any:
    """Build one part of a plan, such as a room, from its JSON object.

    Raises
    ------
    UserError
        If a key is missing, unknown or of another type; the message names the part and the key.
    """
    if not isinstance(data, dict):
        raise UserError(f"{where}: is {_short(data)}; give an object with keys {_SEE}")
    fields = {field.name: field for field in dataclasses.fields(cls)}
    needed = [key for key, field in fields.items() if field.default is dataclasses.MISSING]
    _check_keys(data, needed, fields, where)
    values = dict(data)
    for key, value in data.items():
        kind = str(fields[key].type)
        if kind == "str":
            fits, wanted = isinstance(value, str), "text in quotes"
        else:
            fits, wanted = _number(value), f"a number from -{FARTHEST:g} to {FARTHEST:g}"
        if kind == "int":
            fits, wanted = fits and int(value) == value, "a whole number"
        if not fits:
            raise UserError(f"{where}: '{key}' is {_short(value)}; give {wanted}")
        values[key] = int(value) if kind == "int" else value
    return cls(**values)


def _check_keys(
    data: dict[str, Any], needed: Iterable[str], known: Iterable[str], where: str
) -> None:
    """Raise `UserError` for the first key that is missing or unknown."""
    for key in data:
        if key not in known:
            raise UserError(
                f"{where}: unknown key {_short(key)}; delete it, the keys are {', '.join(known)}"
            )
    for key in needed:
        if key not in data:
            raise UserError(f"{where}: key '{key}' is missing; add it {_SEE}")


def _number(value: Any) -> bool:
    """Return True for a finite number of at most `FARTHEST` metres."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and abs(value) <= FARTHEST  # NaN is not


def _short(value: Any) -> str:
    """Return the representation of a value on one line, without the middle of a long one."""
    return " ".join(reprlib.repr(value).split())
