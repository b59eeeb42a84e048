"""Random generation of furnished apartments."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from avn.apartments import furniture
from avn.apartments.curtains import hang_curtains
from avn.apartments.floor_plan import WALL_THICKNESS, FloorPlan, Lamp, Piece
from avn.apartments.furniture import Part
from avn.apartments.grid import build_grid
from avn.apartments.layout import FINISH, SOFT_FINISH, draw_layout, outer_spans
from avn.apartments.placement import DOOR_CLEARANCE, Furnisher, Spot, overlap
from avn.apartments.rooms import FURNISH, add_soft_pieces
from avn.apartments.sources import spread_sources
from avn.core.errors import UserError
from avn.core.random import Draws, Rng, derive

LAMP_HEIGHT = 2.35
# Draws of layouts before the generator gives up; about one in fifty is valid.
_DRAWS = 200_000
_REFITS = 3


@dataclass(frozen=True)
class Size:
    """Range of sizes and of the amount of furniture of apartments.

    Attributes
    ----------
    choices : tuple of (int, int, int)
        Number of rooms, fewest and most grid squares; one choice is drawn.
    richness : (float, float)
        Range of the amount of furniture, from 0 (the indispensable pieces) to 1.
    soft : bool
        True for homes with soft furnishing: carpets in most rooms, and curtains. They are drawn
        from streams that depend on no version of NumPy.
    """

    choices: tuple[tuple[int, int, int], ...]
    richness: tuple[float, float] = (0.0, 1.0)
    soft: bool = False


SIZES = {
    "small": Size(((3, 88, 112),), (0.0, 0.4)),
    "mixed": Size(((3, 85, 125), (4, 130, 190), (5, 150, 200))),
    "large": Size(((4, 150, 200), (5, 150, 200))),
    "roomy": Size(((4, 175, 200), (5, 180, 200)), (0.05, 0.7)),
    "homes": Size(((3, 85, 125), (4, 130, 190), (5, 150, 200)), richness=(0.1, 1.0), soft=True),
    "airy": Size(((4, 196, 200),), (0.0, 0.06)),
}


def generate(
    seed: int,
    name: str,
    sources: int = 5,
    size: str = "mixed",
    accepts: Callable[[FloorPlan], bool] | None = None,
    skip: int = 0,
    tally: Counter[str] | None = None,
) -> FloorPlan:
    """Draw an apartment.

    Parameters
    ----------
    seed : int
        The same seed, size, number of sources and accepted layouts give the same apartment.
    name : str
        Name of the apartment.
    sources : int
        Number of source positions, spread over the rooms.
    size : str
        A key of `SIZES`.
    accepts : callable, optional
        Test of a layout: a plan without furniture. Layouts that it rejects are drawn again.
    skip : int
        Number of draws to leave out that are known to give no valid apartment, to save time; for
        sizes with soft furnishing.
    tally : Counter, optional
        Counts the draws by outcome: no `layout` that is valid, one that is not `accepted`, no
        valid `furnishing`, `whole`.

    Raises
    ------
    UserError
        If the size is unknown, no layout is accepted, or `sources` is below 1 or more than the
        apartment has room for.
    """
    if size not in SIZES:
        raise UserError(f"split.size is '{size}'; choose one of {', '.join(SIZES)}")
    if sources < 1:
        raise UserError(f"split: {sources} sources an apartment; ask for at least 1")
    soft, choices = SIZES[size].soft, SIZES[size].choices
    finish = SOFT_FINISH if soft else FINISH
    rng: Rng = Draws(seed) if soft else np.random.default_rng([seed, 20_240])
    count, fewest, most = choices[int(rng.integers(len(choices)))]
    richness = float(rng.uniform(*SIZES[size].richness))
    for number in range(skip, _DRAWS):
        if soft:  # each draw has a stream of its own, so that draws can be skipped
            rng = Draws(derive("draw", seed, number))
        plan, outcome = draw_layout(name, count, (fewest, most), rng, finish), "layout"
        if plan is not None and (accepts is None or accepts(plan)):
            plan, outcome = _furnish(plan, richness, rng, soft), "furnishing"
        elif plan is not None:
            plan, outcome = None, "accepted"
        if tally is not None:
            tally["whole" if plan is not None else outcome] += 1
        if plan is not None:
            plan = hang_curtains(plan, rng) if soft else plan
            return _with_sources(plan, sources, rng)
    raise UserError(
        f"split: no new layout of size {size} found for apartment {name}; take another "
        "split.seed, or ask for fewer apartments"
    )


def _furnish(plan: FloorPlan, richness: float, rng: Rng, soft: bool) -> FloorPlan | None:
    """Furnish every room; return None if a room cannot be furnished or cells are not connected."""
    with_table = _dining_room(plan)
    pieces: list[Piece] = []
    bedrooms = [r for r in plan.rooms if r.kind == "bedroom"]
    main = max(bedrooms, key=lambda r: (r.x1 - r.x0) * (r.y1 - r.y0), default=None)
    for index, room in enumerate(plan.rooms):
        for _ in range(_REFITS):
            furnisher = Furnisher(plan, room, rng)
            entered = index != _entrance_room(plan) or _front_door(plan, furnisher)
            special = room is main if room.kind == "bedroom" else index == with_table
            if entered and FURNISH[room.kind](furnisher, richness, special):
                break
        else:
            return None
        if soft:
            add_soft_pieces(furnisher, room.kind)
        pieces += furnisher.pieces
    lamps = tuple(Lamp((r.x0 + r.x1) / 2, (r.y0 + r.y1) / 2, LAMP_HEIGHT) for r in plan.rooms)
    plan = replace(plan, furniture=tuple(pieces), lamps=lamps)
    try:
        build_grid(plan)
    except UserError:
        return None
    return plan


def _entrance_room(plan: FloorPlan) -> int:
    """Return the index of the room with the front door."""
    kinds = [room.kind for room in plan.rooms]
    return kinds.index("living_room" if "living_room" in kinds else "kitchen")


def _dining_room(plan: FloorPlan) -> int:
    """Return the index of the kitchen if a dining table fits into it, else of the living room."""
    kinds = [room.kind for room in plan.rooms]
    kitchen = plan.rooms[kinds.index("kitchen")]
    wide = min(kitchen.x1 - kitchen.x0, kitchen.y1 - kitchen.y0) >= 3.0
    return kinds.index("kitchen" if wide or "living_room" not in kinds else "living_room")


def _front_door(plan: FloorPlan, furnisher: Furnisher) -> bool:
    """Put the front door into an outer wall of the room, and keep the floor before it free."""
    x0, y0, x1, y1 = furnisher.floor
    room = plan.rooms[_entrance_room(plan)]
    door = Part(furniture.FRONT_DOOR, 0.0, furniture.FRONT_DOOR.depth / 2)
    half, thick = furniture.FRONT_DOOR.width / 2, WALL_THICKNESS / 2
    reach = furniture.FRONT_DOOR.depth + DOOR_CLEARANCE
    spots = []
    for along, line, low, high in outer_spans(room, plan.rooms):
        for at in (low + thick + half + 0.1, high - thick - half - 0.1):
            if along == "x":
                inner, heading = (y0, 0) if line < (y0 + y1) / 2 else (y1, 2)
                spot = Spot(at, inner, heading, 0.0)
            else:
                inner, heading = (x0, 1) if line < (x0 + x1) / 2 else (x1, 3)
                spot = Spot(inner, at, heading, 0.0)
            before = spot.place((-half, 0.0, half, reach))
            clash = any(overlap(before, zone) for zone in furnisher.zones)
            if high - low > 1.2 and not clash and not furnisher.is_before_window(before):
                spots.append((spot, before))
    if not spots:
        return False
    spot, before = spots[int(furnisher.rng.integers(len(spots)))]
    furnisher.pieces.append(spot.piece(door))
    furnisher.zones.append(spot.place((-half, furniture.FRONT_DOOR.depth, half, reach)))
    return True


def _with_sources(plan: FloorPlan, count: int, rng: Rng) -> FloorPlan:
    grid = build_grid(plan)
    return replace(plan, sources=tuple(spread_sources(plan, grid, count, rng)))
