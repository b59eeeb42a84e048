"""Which models are taken from which library, for which kinds of piece and which pool.

Libraries: `cc0` BlendSwap-CC-0, `ccby` BlendSwap-CC-BY, `scopia` Scopia, `kator` KatorLegaz.
Read by `extract_furniture.py`.
"""

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
    turn: int = 0


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
    turn: int = 0,
) -> Entry:
    """An entry that is one model of a library."""
    return Entry(kinds, pool, [Source(source, bend=bend or {}, turn=turn)], row, size, tint)


def planted(
    source: str, pool: str, pot: tuple[float, float, float], low: float, sunk: float
) -> Entry:
    """A plant in a square planter that is `low` of the height; its own pot sinks in by `sunk`."""
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
    """A cabinet of boxes: body, plinth and worktop where `top` is given, doors with handles."""
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


# A door's leaf without its handles and what its frame has more than the leaf.
LEAF: dict[str, Knots] = {"v": [(0.3, 0.0), (0.72, 1.0)]}
LOW_BED: dict[str, Knots] = {"w": [(0.0, 0.0), (0.55, 0.75), (1.0, 1.0)]}
SEAT: dict[str, Knots] = {"u": [(0.06, 0.0), (0.94, 1.0)]}

ENTRIES: list[Entry] = [
    # bedroom
    one("cc0/bed1", "bed", TRAIN),
    one("cc0/bedWithTexture", "bed", VAL),
    one("ccby/lettoCloud", "bed", TRAIN),
    one("scopia/children_bed", "bed", VAL, LOW_BED),
    one("cc0/bed3", "bed", VAL, LOW_BED),
    one("ccby/juniorBed", "bed", TRAIN),
    one("scopia/convertible-sofa-BZ-opened", "bed", VAL),
    one("cc0/bed2", "bed", TEST, LOW_BED),
    one("scopia/bed1", "bed", TEST, LOW_BED),
    one("scopia/captains-bed", "bed", TEST, LOW_BED),
    one("scopia/iron_bed", "bed", TEST, LOW_BED),
    one("cc0/bedsideTable2", "nightstand", VAL),
    one("kator/filing-cabinet", "nightstand", TRAIN),
    one("ccby/bedsideTable", "nightstand", TRAIN),
    one("cc0/shelves", "nightstand dresser", TEST),
    one("ccby/chest", "dresser sideboard tv_stand", TRAIN),
    one("scopia/changing-table", "dresser sideboard", VAL, tint=(1.7, 1.6, 1.5)),
    one("scopia/box_room", "dresser sideboard", VAL),
    one("ccby/dresserWithDrawers", "dresser sideboard tv_stand", TEST),
    one("scopia/office_furniture1", "sideboard", TRAIN),
    one("ccby/wardrobe", "wardrobe bath_cabinet", TRAIN, row=True),
    one("scopia/wardrobe1", "wardrobe", TRAIN),
    one("ccby/wardrobe2", "wardrobe", VAL, tint=(1.5, 1.4, 1.25)),
    one("cc0/wardrobeWithSlidingDoors", "wardrobe", TEST),
    one("cc0/cupboard", "wardrobe", TEST, row=True),
    # desks
    one("cc0/desk", "desk", TRAIN),
    one("ccby/simpleDesk", "desk", TRAIN),
    one("ccby/officeTable", "desk", TRAIN),
    one("scopia/wooden_office_alder_table", "desk dining_table", TRAIN),
    one("ccby/biurko3", "desk", VAL),
    one("scopia/kids_wooden_desk", "desk", VAL),
    one("cc0/lbDesk", "desk", TEST),
    one("scopia/kids_desk_table", "desk", TEST, tint=(1.6, 1.6, 1.6)),
    # chairs
    one("cc0/armchair", "chair", TRAIN),
    one("cc0/chair", "chair", VAL),
    one("cc0/chair2", "chair", TRAIN, SEAT),
    one("cc0/oakChair", "chair", TRAIN, SEAT),
    one("ccby/cafe_set_tonon_chair", "chair", TRAIN),
    one("ccby/plaidChair", "chair", TRAIN),
    one("scopia/chair3", "chair", TRAIN),
    one("scopia/white_kitchen_chair", "chair", TRAIN, tint=(1.6, 1.6, 1.6)),
    one("cc0/plasticChair", "chair", VAL),
    one("cc0/chairWithCushion", "chair", TRAIN),
    one("ccby/ella_chair_f", "chair", VAL),
    one("ccby/chair3", "chair", VAL),
    one("scopia/tubular_chair", "chair", VAL),
    one("cc0/osakaChair", "chair", TEST),
    one("cc0/sillaBlanca", "chair", TEST),
    one("ccby/chairWithCushion", "chair", TEST),
    one("ccby/kitchenChair", "chair", TEST),
    one("scopia/chair4", "chair", TRAIN),
    one("scopia/chair", "chair", TEST),
    one("scopia/plastic_chair", "chair", TEST),
    # armchairs
    one("cc0/armchair2", "armchair", TRAIN),
    one("cc0/winchesterArmchair", "armchair", TRAIN),
    one("ccby/armchair1", "armchair", TRAIN),
    one("scopia/armchair", "armchair", TRAIN),
    one("cc0/modernArmchair", "armchair", VAL),
    one("scopia/armchair3", "armchair", VAL),
    one("scopia/rattanArmchair", "armchair", VAL),
    one("ccby/fotel", "armchair", TEST),
    one("scopia/armchair2", "armchair", TEST),
    one("kator/mid-century-chair", "armchair", TEST),
    # sofas
    one("cc0/sofa2", "sofa", TRAIN),
    one("cc0/winchesterSofa", "sofa", TRAIN),
    one("ccby/couch3", "sofa", TRAIN),
    one("scopia/clear_sofa", "sofa", TRAIN),
    one("scopia/beige_sofa_2seats", "sofa", TRAIN),
    one("scopia/sofa_white_beige", "sofa", TRAIN),
    one("kator/futon-couch", "sofa", TRAIN),
    one("cc0/couch", "sofa", VAL),
    one("ccby/sofa2", "sofa", VAL),
    one("scopia/burlap_sofa", "sofa", VAL),
    one("scopia/rattanSofa", "sofa", VAL),
    one("kator/mid-century-bench-sofa", "sofa", VAL),
    one("ccby/sofa3", "sofa", TEST),
    one("scopia/simple_sofa", "sofa", TEST),
    one("scopia/leather_sofa", "sofa", TEST),
    one("scopia/convertible-sofa-BZ-closed", "sofa", TEST),
    one("kator/mid-century-sofa", "sofa", TEST),
    # low tables and what a television stands on
    one("ccby/coffeeTable", "coffee_table", TRAIN),
    one("scopia/living_room_table", "coffee_table", TRAIN),
    one("cc0/table", "coffee_table dining_table", TRAIN),
    one("scopia/saloon_table", "coffee_table", VAL),
    one("scopia/rattanTable", "coffee_table tv_stand", VAL),
    one("scopia/coffee-table2", "coffee_table", TEST),
    one("scopia/table_wood_and_iron", "coffee_table", TEST),
    one("ccby/tvStand", "tv_stand", TRAIN),
    one("scopia/wall-flat-tv", "television", TRAIN, {"v": [(0.3, 0), (1, 1)]}),
    one("cc0/led_tv", "television", VAL, {"v": [(0.44, 0), (0.61, 1)]}),
    one("scopia/tv", "television", TEST, {"v": [(0.36, 0), (0.67, 1)]}),
    # dining tables
    one("ccby/cafe_set_tonon_table", "dining_table", TRAIN),
    one("scopia/table4", "dining_table", TRAIN),
    one("scopia/wooden_table_office", "dining_table", TRAIN),
    one("scopia/table-on-trestles", "dining_table", TRAIN),
    one("kator/glass-dining-table", "dining_table", TRAIN),
    one("ccby/table", "dining_table", VAL),
    one("scopia/wooden_office_pear_table_rect", "dining_table desk", VAL),
    one("scopia/bar_table", "dining_table", VAL),
    one("kator/folding-table", "dining_table", VAL),
    one("scopia/black_table", "dining_table", TEST),
    one("scopia/metal_glass_table", "dining_table", TEST),
    one("scopia/white_kitchen_table", "dining_table", TEST, tint=(1.6, 1.6, 1.6)),
    one("scopia/table3", "dining_table", TRAIN),
    # shelves
    one("cc0/bookcase", "bookshelf", TRAIN),
    one("scopia/kids_shelves", "bookshelf", TRAIN, tint=(1.6, 1.6, 1.6)),
    one("ccby/bookcase", "bookshelf", VAL, tint=(1.4, 1.35, 1.2)),
    one("kator/utility-shelving", "bookshelf", VAL),
    one("cc0/verticalShelves", "bookshelf bath_cabinet", TEST, row=True),
    one("kator/full-bookcase", "bookshelf", TEST),
    # plants
    planted("cc0/plant", TRAIN, (0.10, 0.10, 0.11), 0.36, 0.1),
    planted("cc0/littlePlant", TRAIN, (0.45, 0.20, 0.12), 0.55, 0.12),
    planted("scopia/maceta", TRAIN, (0.70, 0.68, 0.62), 0.45, 0.2),
    planted("cc0/augalas", VAL, (0.30, 0.17, 0.09), 0.55, 0.06),
    planted("ccby/yuccaPlant", VAL, (0.25, 0.27, 0.30), 0.30, 0.1),
    planted("ccby/decorativePlant", TEST, (0.60, 0.58, 0.55), 0.45, 0.15),
    planted("scopia/ficus", TEST, (0.16, 0.10, 0.07), 0.30, 0.1),
    # kitchen
    one("cc0/refrigerator", "fridge", TRAIN),
    one("kator/fridge", "fridge", VAL, tint=(1.3, 1.3, 1.3)),
    one("cc0/largeFridge", "fridge", TEST),
    Entry(
        "stove",
        TRAIN,
        [
            Slab((0, 0, 0, 1, 0.9, 0.3), (0.08, 0.08, 0.08)),
            Slab((0.01, 0.85, 0.08, 0.99, 0.95, 0.29), STEEL),
            Source("cc0/oven", (0, 0, 0.3, 1, 1, 0.96)),
            Slab((0, 0, 0.955, 1, 0.99, 0.975), (0.06, 0.06, 0.07)),
            Source("cc0/mano_cooktop", (0.05, 0.08, 0.97, 0.95, 0.95, 1)),
        ],
        size=(0.6, 0.6, 0.9),
        name="oven_and_cooktop",
    ),
    one("kator/propane-stove", "stove", VAL),
    one("ccby/largeStove", "stove", TEST),
    one("cc0/sinkCabinet", "sink", TRAIN, {"w": [(0, 0), (0.73, 0.96), (1, 1)]}),
    one("cc0/modernVanity", "sink basin", VAL, {"w": [(0, 0), (0.86, 0.95), (1, 1)]}),
    one("ccby/kitchenSink", "sink", TEST, {"w": [(0, 0), (0.89, 0.96), (1, 1)]}),
    one("cc0/lowerCabinet", "counter", TRAIN, row=True),
    one("cc0/drawersCabinet", "counter", TRAIN, row=True),
    Entry(
        "counter",
        VAL,
        cabinet((0.16, 0.24, 0.26), (0.5, 0.49, 0.46), (0.34, 0.22, 0.13), 2, False),
        row=True,
        size=(0.8, 0.6, 0.9),
        name="counter_with_doors",
    ),
    Entry(
        "counter",
        VAL,
        cabinet((0.16, 0.24, 0.26), (0.5, 0.49, 0.46), (0.34, 0.22, 0.13), 1, True),
        row=True,
        size=(0.6, 0.6, 0.9),
        name="counter_with_drawer",
    ),
    one("ccby/kitchenLowerCabinet", "counter", TEST, row=True),
    one("ccby/kitchenSmallLowerCabinet", "counter", TEST, row=True),
    one("ccby/kitchenDrawersCabinet", "counter", TEST, row=True),
    one("cc0/upperCabinet", "cupboard", TRAIN, row=True),
    one("cc0/glassDoorCabinet", "cupboard", TRAIN, row=True),
    Entry(
        "cupboard",
        VAL,
        cabinet((0.16, 0.24, 0.26), (0.5, 0.49, 0.46), None, 2, False),
        row=True,
        size=(0.8, 0.35, 0.7),
        name="cupboard_with_doors",
    ),
    one("ccby/kitchenGlassDoorCabinet", "cupboard", VAL, row=True),
    one("ccby/kitchenUpperCabinet", "cupboard", TEST, row=True),
    one("ccby/kitchenSmallUpperCabinet", "cupboard", TEST, row=True),
    # bathroom
    one("cc0/toiletsUnit", "toilet", TRAIN),
    one("ccby/modernToilet", "toilet", VAL),
    one("ccby/toilets_unit_jay_hardy", "toilet", TEST, {"u": [(0.12, 0), (0.88, 1)]}),
    one("cc0/washbasin", "basin", TRAIN),
    one("scopia/bathroom3", "basin", TRAIN),
    Entry(
        "basin",
        VAL,
        [
            Slab((0.08, 0, 0, 0.92, 0.85, 0.68), (0.30, 0.20, 0.12)),
            Slab((0.10, 0.8, 0.05, 0.495, 0.88, 0.66), (0.34, 0.23, 0.14)),
            Slab((0.505, 0.8, 0.05, 0.90, 0.88, 0.66), (0.34, 0.23, 0.14)),
            Source("scopia/small_lavatory", (0, 0, 0.6, 1, 1, 1)),
        ],
        size=(0.55, 0.45, 0.85),
        name="basin_on_cabinet",
    ),
    one("ccby/washbasin_jay_hardy", "basin", TEST),
    Entry(
        "basin",
        TEST,
        [
            Slab((0.06, 0, 0.1, 0.94, 0.9, 0.72), (0.08, 0.08, 0.09)),
            Slab((0.07, 0.85, 0.42, 0.93, 0.93, 0.70), (0.12, 0.12, 0.13)),
            Slab((0.07, 0.85, 0.11, 0.93, 0.93, 0.40), (0.12, 0.12, 0.13)),
            Source("scopia/bathroom4", (0, 0, 0.7, 1, 1, 1), {"w": [(0.45, 0), (1, 1)]}),
        ],
        size=(0.6, 0.5, 0.85),
        name="square_basin_on_drawers",
    ),
    one(
        "scopia/corner_bathtub",
        "bathtub",
        TRAIN,
        {"u": [(0.05, 0), (0.95, 1)]},
        size=(1.6, 0.8, 0.6),
    ),
    one(
        "scopia/islandBath",
        "bathtub",
        VAL,
        {"u": [(0.05, 0), (0.95, 1)], "v": [(0.2, 0), (0.96, 1)]},
        size=(1.7, 0.75, 0.6),
    ),
    one("ccby/bath_jay_hardy", "bathtub", TEST),
    Entry(
        "shower",
        TRAIN,
        [
            Slab((0, 0, 0, 1, 1, 0.06), WHITE),
            Slab((0, 0, 0.06, 0.02, 0.99, 0.98), GLASSY),
            Slab((0.98, 0, 0.06, 1, 0.99, 0.98), GLASSY),
            Slab((0, 0, 0.06, 1, 0.02, 1), WHITE),
            Source("cc0/showerDoor", (0, 0.97, 0.06, 1, 1, 1)),
            Source("cc0/shower", (0.35, 0.02, 0.5, 0.65, 0.6, 0.98)),
        ],
        size=(0.8, 0.8, 2.0),
        name="shower_with_door",
    ),
    Entry(
        "shower",
        VAL,
        [
            Slab((0, 0, 0, 1, 1, 0.09), WHITE),
            Slab((0, 0, 0.09, 1, 0.02, 1), (0.45, 0.55, 0.58)),
            Slab((0, 0, 0.09, 0.02, 0.97, 1), (0.45, 0.55, 0.58)),
            Slab((0.98, 0, 0.09, 1, 0.97, 1), GLASSY),
            Source("kator/showerCurtain", (0.02, 0.84, 0.05, 0.98, 1, 1)),
            Source("kator/showerHeadAndFaucet", (0.35, 0.02, 0.5, 0.65, 0.35, 0.97)),
        ],
        size=(0.8, 0.8, 2.0),
        name="shower_with_curtain",
    ),
    one("cc0/showerStall", "shower", TEST),
    one("scopia/clothes_washing_machine", "washing_machine", TRAIN),
    one("ccby/washing_machine", "washing_machine", VAL),
    one("scopia/dryer_machine", "washing_machine", TEST),
    Entry(
        "bath_cabinet",
        VAL,
        cabinet((0.55, 0.56, 0.55), (0.5, 0.5, 0.49), None, 1, True),
        size=(0.4, 0.3, 1.6),
        name="tall_cabinet",
    ),
    # front doors
    one("scopia/puerta", "front_door", TRAIN, LEAF),
    one("scopia/door", "front_door", TRAIN, LEAF, tint=(1.7, 1.65, 1.5)),
    one("kator/exterior-door-01", "front_door", TRAIN, LEAF),
    one("kator/exterior-door-05", "front_door", VAL, LEAF),
    one("kator/exterior-door-02", "front_door", VAL, LEAF, tint=(0.5, 0.7, 0.9)),
    one("kator/exterior-door-07", "front_door", TEST, LEAF, tint=(0.7, 0.9, 0.7)),
    one("kator/exterior-door-03", "front_door", TEST, LEAF, tint=(1.2, 1.1, 0.9)),
]
