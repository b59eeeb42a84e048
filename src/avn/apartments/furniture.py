"""Catalogue of furniture: sizes, materials and groups of pieces.

Sizes are those of common pieces of furniture, in metres. A `Group` is placed as a whole, such as
a bed with its nightstands. It has a frame of its own: v points in the direction that the group
faces, u to the right of it, and v = 0 is the wall.
"""

from __future__ import annotations

from dataclasses import dataclass, field

Rect = tuple[float, float, float, float]


@dataclass(frozen=True)
class Model:
    """One piece of the catalogue: kind, size, material, height of its underside, in metres."""

    kind: str
    width: float
    depth: float
    height: float
    material: str
    z: float = 0.0


@dataclass(frozen=True)
class Part:
    """A model within a group: centre (u, v) in metres and rotation in quarter turns."""

    model: Model
    u: float
    v: float
    turn: int = 0

    @property
    def rect(self) -> Rect:
        """Footprint u0, v0, u1, v1."""
        a, b = self.model.width / 2, self.model.depth / 2
        if self.turn % 2:
            a, b = b, a
        return self.u - a, self.v - b, self.u + a, self.v + b


@dataclass(frozen=True)
class Group:
    """Pieces that are placed together, and the floor that must stay free to use them.

    Parameters
    ----------
    parts : tuple of Part
        The pieces.
    zones : tuple of Rect
        Floor that no piece may stand on, u0, v0, u1, v1, metres.
    corner, centre : float
        Bonus in the score of a position in a corner, or at the middle of the wall.
    corner_only : bool
        True for groups that are placed in corners only.
    against_wall : bool
        False for groups that stand free in the room.
    across : float
        Distance from wall to wall that the group spans, metres; 0 if it does not.

    Attributes
    ----------
    extent : Rect
        Bounds of all parts, u0, v0, u1, v1, metres.
    """

    parts: tuple[Part, ...]
    zones: tuple[Rect, ...]
    corner: float = 0.0
    centre: float = 0.0
    corner_only: bool = False
    against_wall: bool = True
    across: float = 0.0
    extent: Rect = field(init=False)

    def __post_init__(self) -> None:
        """Compute the extent."""
        rects = [part.rect for part in self.parts]
        low = [min(r[i] for r in rects) for i in (0, 1)]
        high = [max(r[i] for r in rects) for i in (2, 3)]
        object.__setattr__(self, "extent", (low[0], low[1], high[0], high[1]))


DOUBLE_BED = Model("bed", 1.6, 2.05, 0.55, "mattress")
SMALL_DOUBLE_BED = Model("bed", 1.4, 2.0, 0.55, "mattress")
SINGLE_BED = Model("bed", 0.9, 2.0, 0.5, "mattress")
NIGHTSTAND = Model("nightstand", 0.45, 0.4, 0.55, "wood")
DRESSER = Model("dresser", 0.9, 0.45, 0.8, "wood")
DESK = Model("desk", 1.2, 0.6, 0.74, "wood")
CHAIR = Model("chair", 0.45, 0.45, 0.9, "wood")
ARMCHAIR = Model("armchair", 0.75, 0.8, 0.8, "fabric")
COFFEE_TABLE = Model("coffee_table", 0.9, 0.5, 0.42, "wood")
TELEVISION = Model("television", 1.05, 0.06, 0.62, "glass", z=0.5)
SOFA_DEPTH, SLIM_SOFA_DEPTH = 0.85, 0.74
TV_STAND = Model("tv_stand", 1.2, 0.4, 0.5, "laminate")
SIDEBOARD = Model("sideboard", 1.4, 0.45, 0.8, "wood")
BOOKSHELF = Model("bookshelf", 0.9, 0.3, 1.9, "books")
SHALLOW_BOOKSHELF = Model("bookshelf", 0.8, 0.24, 1.9, "books")
PLANT = Model("plant", 0.35, 0.35, 1.2, "fabric")
FRIDGE = Model("fridge", 0.6, 0.65, 1.8, "metal")
STOVE = Model("stove", 0.6, 0.6, 0.9, "metal")
SINK = Model("sink", 0.8, 0.6, 0.9, "metal")
DINING_TABLE = Model("dining_table", 1.2, 0.8, 0.75, "wood")
BISTRO_TABLE = Model("dining_table", 0.7, 0.68, 0.75, "wood")
SMALL_TABLE = Model("dining_table", 0.8, 0.75, 0.75, "wood")
TOILET = Model("toilet", 0.4, 0.68, 0.8, "ceramic")
BASIN = Model("basin", 0.55, 0.45, 0.85, "ceramic")
BATHTUB = Model("bathtub", 1.7, 0.72, 0.58, "ceramic")
SHOWER = Model("shower", 0.8, 0.8, 2.0, "glass")
WASHING_MACHINE = Model("washing_machine", 0.6, 0.6, 0.85, "metal")
BATH_CABINET = Model("bath_cabinet", 0.4, 0.3, 1.6, "laminate")
# An open curtain, and the widths that it may have.
CURTAIN = Model("curtain", 0.6, 0.1, 2.48, "fabric", z=0.02)
CURTAIN_WIDTHS = (0.6, 0.5, 0.4, 0.3)
FRONT_DOOR = Model("front_door", 0.9, 0.05, 2.05, "wood")


def single(
    model: Model,
    front: float,
    corner: float = 0.0,
    centre: float = 0.0,
    corner_only: bool = False,
) -> Group:
    """Return a group of one piece at a wall.

    Parameters
    ----------
    model : Model
        The piece.
    front : float
        Depth of the free floor in front of it, metres.
    corner, centre, corner_only
        As in `Group`.
    """
    half = model.width / 2
    zone = (-half, model.depth, half, model.depth + front)
    zones = (zone,) if front > 0 else ()
    return Group((Part(model, 0.0, model.depth / 2),), zones, corner, centre, corner_only)


def bed_between_nightstands(bed: Model) -> Group:
    """Return a double bed, headboard at the wall, with a nightstand and access on both sides."""
    beside = bed.width / 2 + NIGHTSTAND.width / 2
    edge, way = bed.width / 2, bed.width / 2 + 0.55
    stands = [Part(NIGHTSTAND, side * beside, NIGHTSTAND.depth / 2) for side in (-1, 1)]
    return Group(
        (Part(bed, 0.0, bed.depth / 2), *stands),
        (
            (-way, NIGHTSTAND.depth, -edge, bed.depth),
            (edge, NIGHTSTAND.depth, way, bed.depth),
            (-edge, bed.depth, edge, bed.depth + 0.45),
        ),
        centre=1.0,
    )


def bed_in_corner(bed: Model, side: int) -> Group:
    """Return a bed in a corner, with a nightstand on its open side (-1 or 1)."""
    stand = Part(NIGHTSTAND, side * (bed.width + NIGHTSTAND.width) / 2, NIGHTSTAND.depth / 2)
    way = sorted((side * bed.width / 2, side * (bed.width / 2 + 0.6)))
    return Group(
        (Part(bed, 0.0, bed.depth / 2), stand),
        ((way[0], NIGHTSTAND.depth, way[1], bed.depth),),
        corner_only=True,
    )


def wardrobe(width: float) -> Group:
    """Return a wardrobe with free floor to open its doors."""
    return single(Model("wardrobe", width, 0.6, 2.1, "wood"), 0.6, corner=1.0)


def desk_with_chair() -> Group:
    """Return a desk at the wall and a chair in front of it that faces the desk."""
    seat = DESK.depth + CHAIR.depth
    return Group(
        (Part(DESK, 0.0, DESK.depth / 2), Part(CHAIR, 0.0, seat - CHAIR.depth / 2, turn=2)),
        ((-0.35, seat, 0.35, seat + 0.45),),
        corner=0.6,
    )


def kitchen_run(counters: tuple[float, float], flipped: bool, cupboards: bool) -> Group:
    """Return fridge, counter, sink, counter and stove side by side along one wall.

    Parameters
    ----------
    counters : (float, float)
        Widths of the two counters, metres; 0 for none.
    flipped : bool
        True for the reverse order.
    cupboards : bool
        True for wall cupboards over all but the fridge.
    """
    first, second = (Model("counter", w, 0.6, 0.9, "laminate") for w in counters)
    row = [FRIDGE, first, SINK, second, STOVE]
    row = [model for model in row if model.width > 0]
    total = sum(model.width for model in row)
    parts, at = [], -total / 2
    for model in row:
        centre = at + model.width / 2
        parts.append(Part(model, -centre if flipped else centre, model.depth / 2))
        at += model.width
    if cupboards:
        hung = total - FRIDGE.width
        centre = FRIDGE.width / 2 * (-1 if flipped else 1)
        cupboard = Model("cupboard", hung, 0.35, 0.7, "laminate", z=1.45)
        parts.append(Part(cupboard, centre, cupboard.depth / 2))
    zone = (-total / 2, FRIDGE.depth, total / 2, FRIDGE.depth + 0.7)
    return Group(tuple(parts), (zone,), corner=1.5)


def _seats(side_v: float, turn: int, count: int) -> list[Part]:
    places = (0.0,) if count == 1 else (-0.28, 0.28)
    return [Part(CHAIR, u, side_v, turn) for u in places]


def table_in_the_room(table: Model, seats: int) -> Group:
    """Return a free-standing table with `seats` (1 or 2) chairs on either long side."""
    beside = table.depth / 2 + CHAIR.depth / 2
    behind = table.depth / 2 + CHAIR.depth
    chairs = [*_seats(-beside, 0, seats), *_seats(beside, 2, seats)]
    half = table.width / 2
    zones = ((-half, behind, half, behind + 0.4), (-half, -behind - 0.4, half, -behind))
    return Group((Part(table, 0.0, 0.0), *chairs), zones, against_wall=False)


def table_at_the_wall(table: Model, seats: int) -> Group:
    """Return a table with one end at the wall and `seats` chairs on either side."""
    beside = table.depth / 2 + CHAIR.depth / 2
    behind = table.depth / 2 + CHAIR.depth
    places = (table.width / 2,) if seats == 1 else (table.width / 2 - 0.28, table.width / 2 + 0.28)
    chairs = [Part(CHAIR, side * beside, v, 2 + side) for side in (-1, 1) for v in places]
    # The table is rotated by a quarter turn: its long side is along v.
    return Group(
        (Part(table, 0.0, table.width / 2, turn=1), *chairs),
        (
            (behind, 0.0, behind + 0.4, table.width),
            (-behind - 0.4, 0.0, -behind, table.width),
        ),
        centre=0.5,
    )


def sofa_and_television(width: float, across: float, coffee_table: bool) -> Group:
    """Return a sofa at one wall and a television on its stand at the opposite one.

    Parameters
    ----------
    width : float
        Width of the sofa, metres; up to 1.4 m it is a slim one for two.
    across : float
        Distance between the walls, metres.
    coffee_table : bool
        True for a coffee table between them.
    """
    depth = SLIM_SOFA_DEPTH if width <= 1.4 else SOFA_DEPTH
    sofa = Model("sofa", width, depth, 0.8, "upholstery")
    screen_wall = across - TV_STAND.depth / 2
    parts = [
        Part(sofa, 0.0, sofa.depth / 2),
        Part(TV_STAND, 0.0, screen_wall, turn=2),
        Part(TELEVISION, 0.0, screen_wall, turn=2),
    ]
    seen_from = sofa.depth
    if coffee_table:
        seen_from = sofa.depth + 0.4 + COFFEE_TABLE.depth
        parts.append(Part(COFFEE_TABLE, 0.0, seen_from - COFFEE_TABLE.depth / 2))
    zones = (
        (-width / 2, sofa.depth, width / 2, sofa.depth + 0.4),
        (-0.5, seen_from, 0.5, across - TV_STAND.depth),
    )
    return Group(tuple(parts), zones, centre=0.7, across=across)
