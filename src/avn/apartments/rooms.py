"""Furnishing of each kind of room: indispensable pieces first, then optional ones."""

from __future__ import annotations

from collections.abc import Callable

from avn.apartments import furniture as f
from avn.apartments.furniture import Group, Model
from avn.apartments.placement import Furnisher
from avn.core.random import Rng

# Largest distance from wall to wall between a sofa and a television, metres.
_VIEWING = 4.6
# Apartments of less richness than this have small furniture and few optional pieces.
LEAN = 0.1


def _pick(rng: Rng, *options: Group) -> list[Group]:
    """Shuffle the options, to be tried until one fits."""
    return [options[i] for i in rng.permutation(len(options))]


def _first(room: Furnisher, groups: list[Group]) -> bool:
    return any(room.add(group) for group in groups)


def _shelf(model: Model) -> Group:
    return f.single(model, 0.45, corner=0.5)


def _maybe(room: Furnisher, groups: list[Group], chance: float) -> bool:
    return bool(room.rng.random() < chance) and _first(room, groups)


def furnish_bedroom(room: Furnisher, richness: float, main: bool) -> bool:
    """Furnish a bedroom: a bed, a wardrobe, and if they fit a desk, a dresser, shelves, a plant.

    Parameters
    ----------
    room : Furnisher
        The room.
    richness : float
        Amount of furniture, 0 to 1.
    main : bool
        True for the largest bedroom, which has a double bed.

    Returns
    -------
    bool
        False if an indispensable piece does not fit.
    """
    rng = room.rng
    doubles = [
        f.bed_between_nightstands(f.DOUBLE_BED),
        f.bed_between_nightstands(f.SMALL_DOUBLE_BED),
    ]
    small = [f.bed_in_corner(f.SMALL_DOUBLE_BED, side) for side in (-1, 1)]
    singles = [f.bed_in_corner(f.SINGLE_BED, side) for side in (-1, 1)]
    if richness < LEAN:
        beds = _pick(rng, *singles)
    elif main:
        beds = doubles if rng.random() < 0.3 + 0.6 * richness else doubles[1:] + _pick(rng, *small)
        beds = beds + _pick(rng, *small)
    else:
        beds = _pick(rng, *singles)
    if not _first(room, beds):
        return False
    wardrobes = [f.wardrobe(width) for width in (2.0, 1.5, 1.0)]
    widest = 2 if richness < LEAN else 0 if rng.random() < richness else 1
    if not _first(room, wardrobes[widest:]):
        return False
    if not main or rng.random() < 0.5 * richness:
        _maybe(room, [f.desk_with_chair()], 0.3 + 0.7 * richness)
    _maybe(room, [f.single(f.DRESSER, 0.5, centre=0.3)], richness)
    _maybe(room, [_shelf(f.SHALLOW_BOOKSHELF)], 0.6)
    _maybe(room, [f.single(f.PLANT, 0.0, corner=2.0)], richness)
    return True


def furnish_kitchen(room: Furnisher, richness: float, dining: bool) -> bool:
    """Furnish a kitchen: fridge, sink and stove in one run, a dining table, optional pieces.

    Parameters
    ----------
    room : Furnisher
        The room.
    richness : float
        Amount of furniture, 0 to 1.
    dining : bool
        True if the dining table of the apartment has to be here.

    Returns
    -------
    bool
        False if an indispensable piece does not fit.
    """
    rng = room.rng
    runs = []
    for counters in ((1.2, 1.2), (0.6, 1.2), (0.6, 0.6), (0.0, 0.6), (0.0, 0.0)):
        if sum(counters) <= 0.5 + 2.0 * richness:
            for cupboards in (True, False):
                flips = [f.kitchen_run(counters, flip, cupboards) for flip in (False, True)]
                runs += _pick(rng, *flips)
    if not _first(room, runs):
        return False
    large = _pick(
        rng, f.table_at_the_wall(f.DINING_TABLE, 2), f.table_in_the_room(f.DINING_TABLE, 2)
    )
    small = [f.table_at_the_wall(f.SMALL_TABLE if richness >= LEAN else f.BISTRO_TABLE, 1)]
    if dining and not _first(room, (large if richness > 0.4 else []) + small):
        return False
    if not dining:
        _maybe(room, small, 0.5 * richness)
    _maybe(room, [_shelf(f.SHALLOW_BOOKSHELF)], 0.3)
    _maybe(room, [f.single(f.PLANT, 0.0, corner=2.0)], 0.4 * richness)
    return True


def furnish_living_room(room: Furnisher, richness: float, dining: bool) -> bool:
    """Furnish a living room: a sofa that faces a television, a dining table, optional pieces.

    Parameters
    ----------
    room : Furnisher
        The room.
    richness : float
        Amount of furniture, 0 to 1.
    dining : bool
        True if the dining table of the apartment has to be here.

    Returns
    -------
    bool
        False if an indispensable piece does not fit.
    """
    rng = room.rng
    widths = (2.1, 1.8, 1.6) if richness > 0.35 else (1.6,) if richness >= LEAN else (1.4,)
    depths = sorted({round(room.across(h), 4) for h in range(4) if room.across(h) <= _VIEWING})
    coffee = (True, False) if richness >= LEAN or rng.random() < 0.5 else (False,)
    suites = [
        f.sofa_and_television(width, depth, table)
        for table in coffee
        for width in widths
        for depth in depths
    ]
    if not _first(room, suites):
        return False
    tables = [
        f.table_in_the_room(f.DINING_TABLE, 2),
        f.table_at_the_wall(f.DINING_TABLE, 2),
        f.table_at_the_wall(f.SMALL_TABLE, 1),
    ]
    if richness < LEAN:
        tables = [f.table_at_the_wall(f.BISTRO_TABLE, 1)]
    if dining and not _first(room, tables):
        return False
    _maybe(room, [f.single(f.ARMCHAIR, 0.5, corner=1.0)], richness - LEAN)
    _maybe(room, [f.single(f.SIDEBOARD, 0.5, centre=0.5)], 0.8 * (richness - LEAN))
    _maybe(room, [_shelf(f.BOOKSHELF)], richness - LEAN)
    _maybe(room, [_shelf(f.SHALLOW_BOOKSHELF)], 0.7)
    _maybe(room, [f.desk_with_chair()], 0.4 * richness)
    _maybe(room, [f.single(f.PLANT, 0.0, corner=2.0)], 0.1 + 0.7 * richness)
    return True


def furnish_bathroom(room: Furnisher, richness: float, dining: bool) -> bool:
    """Furnish a bathroom: a toilet, a basin, a tub or a shower, and optional pieces.

    Parameters
    ----------
    room : Furnisher
        The room.
    richness : float
        Amount of furniture, 0 to 1.
    dining : bool
        Ignored.

    Returns
    -------
    bool
        False if an indispensable piece does not fit.
    """
    del dining
    rng = room.rng
    tub, shower = (f.single(model, 0.5, corner_only=True) for model in (f.BATHTUB, f.SHOWER))
    if not _first(room, [tub, shower] if rng.random() < 0.3 + 0.5 * richness else [shower, tub]):
        return False
    if not _first(room, [f.single(f.TOILET, 0.55, centre=0.2)]):
        return False
    if not _first(room, [f.single(f.BASIN, 0.55, centre=0.4)]):
        return False
    _maybe(room, [f.single(f.WASHING_MACHINE, 0.5, corner=1.0)], 0.8 * richness)
    _maybe(room, [f.single(f.BATH_CABINET, 0.4, corner=1.0)], 0.6 * richness)
    return True


def add_soft_pieces(room: Furnisher, kind: str) -> None:
    """Add a reading chair to most bedrooms and living rooms in which one fits."""
    if kind in ("bedroom", "living_room"):
        _maybe(room, [f.single(f.ARMCHAIR, 0.5, corner=1.0)], 0.6)


FURNISH: dict[str, Callable[[Furnisher, float, bool], bool]] = {
    "bedroom": furnish_bedroom,
    "kitchen": furnish_kitchen,
    "living_room": furnish_living_room,
    "bathroom": furnish_bathroom,
}
