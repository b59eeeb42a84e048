"""Entries of `furniture_list.py`: models of a library, or models of several parts."""

from __future__ import annotations

from dataclasses import dataclass, field

Box = tuple[float, float, float, float, float, float]
Knots = list[tuple[float, float]]
WHOLE: Box = (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
TRAIN, VAL, TEST = "train", "validation", "test"

WHITE = (0.76, 0.75, 0.72)
GLASSY = (0.62, 0.72, 0.72)
STEEL = (0.42, 0.43, 0.44)


@dataclass
class Source:
    """A model of a library, or its place in one that is put together.

    `bend` maps fractions of the model's own extent to fractions of the extent that it gets, along
    u (right), v (front) or w (up), and cuts off what lies beyond: a door's handle or a tap would
    otherwise decide how large the rest can be.
    """

    name: str
    at: Box = WHOLE
    bend: dict[str, Knots] = field(default_factory=dict)


@dataclass
class Slab:
    """A plain box within a model that is put together; linear albedo."""

    at: Box
    colour: tuple[float, float, float]


@dataclass
class Entry:
    """A row of the catalogue to be.

    `size` (width, depth, height in metres) where it is not that of what is kept of the source;
    `tint` multiplies plain colours; `triangles` is the most that are kept.
    """

    kinds: str
    pool: str
    parts: list[Source | Slab]
    row: bool = False
    size: tuple[float, float, float] | None = None
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    triangles: int = 9000
    name: str = ""


def one(
    source: str,
    kinds: str,
    pool: str,
    bend: dict[str, Knots] | None = None,
    row: bool = False,
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0),
    size: tuple[float, float, float] | None = None,
    triangles: int = 9000,
) -> Entry:
    """Make an entry of one model of a library."""
    return Entry(kinds, pool, [Source(source, bend=bend or {})], row, size, tint, triangles)


def planted(
    source: str, pool: str, pot: tuple[float, float, float], low: float, sunk: float
) -> Entry:
    """Put a plant into a square planter of `low` times the height; its pot sinks in by `sunk`."""
    soil = (0.05, 0.035, 0.025)
    return Entry(
        "plant",
        pool,
        [
            Slab((0, 0, 0, 1, 1, low), pot),
            Slab((0.06, 0.06, low - 0.02, 0.94, 0.94, low + 0.002), soil),
            Source(source, (0.0, 0.0, low - sunk, 1.0, 1.0, 1.0)),
        ],
        size=(0.35, 0.35, 1.2),
        triangles=20000,
    )


def cabinet(
    front: tuple[float, float, float],
    body: tuple[float, float, float],
    top: tuple[float, float, float] | None,
    doors: int,
    drawer: bool,
) -> list[Source | Slab]:
    """Make a cabinet of boxes: body, plinth, worktop if `top` is given, doors with handles."""
    low, high = (0.11, 0.955) if top else (0.02, 0.99)
    parts: list[Source | Slab] = [Slab((0, 0, low - 0.02, 1, 0.93, high), body)]
    if top:
        parts.append(Slab((0, 0, 0, 1, 0.86, low), (0.08, 0.08, 0.08)))
        parts.append(Slab((0, 0, high, 1, 1, 1), top))
    else:
        parts.append(Slab((0, 0, 0, 1, 0.95, 1), body))
    split = high - 0.2 if drawer else high
    for i in range(doors):
        a, b = i / doors + 0.012, (i + 1) / doors - 0.012
        edge = (b - 0.1, b - 0.07) if i % 2 == 0 else (a + 0.07, a + 0.1)
        parts.append(Slab((a, 0.9, low, b, 0.965, split - 0.012), front))
        parts.append(Slab((edge[0], 0.95, split - 0.26, edge[1], 1, split - 0.08), STEEL))
        if drawer:
            middle = (a + b) / 2
            parts.append(Slab((a, 0.9, split, b, 0.965, high - 0.01), front))
            handle = (middle - 0.12, 0.95, split + 0.085, middle + 0.12, 1, split + 0.11)
            parts.append(Slab(handle, STEEL))
    return parts
