"""Would you live there? Checked with geometry that the generator does not use."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pytest

from avn.apartments.floor_plan import CELL, FloorPlan, Piece, Room, from_dict
from avn.apartments.generator import SIZES, generate
from avn.apartments.grid import Grid, build_grid
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import load_split
from avn.apartments.symmetry import layout_key
from avn.core.errors import UserError

SEEDS = range(12)
EVERYWHERE = {"front_door", "bookshelf", "plant", "chair", "desk", "curtain"}
BELONGS = {
    "kitchen": {"fridge", "counter", "sink", "stove", "cupboard", "dining_table"},
    "bedroom": {"bed", "nightstand", "wardrobe", "dresser", "armchair"},
    "living_room": {
        "sofa", "tv_stand", "television", "coffee_table", "armchair", "sideboard", "dining_table",
    },
    "bathroom": {"toilet", "basin", "bathtub", "shower", "washing_machine", "bath_cabinet"},
}  # fmt: skip
NEEDS = {
    "kitchen": {"fridge", "sink", "stove"},
    "bedroom": {"bed", "wardrobe"},
    "living_room": {"sofa", "tv_stand", "television"},
    "bathroom": {"toilet", "basin"},
}
AT_THE_WALL = {
    "bed", "sofa", "counter", "sink", "stove", "fridge", "cupboard", "wardrobe", "toilet",
    "basin", "bathtub", "shower", "nightstand", "tv_stand", "desk", "bookshelf",
}  # fmt: skip
FACING = ((0, 1), (1, 0), (0, -1), (-1, 0))
Home = tuple[FloorPlan, Grid]


@pytest.fixture(scope="module")
def homes() -> list[Home]:
    """All frozen apartments and some generated ones."""
    frozen = load_split(SplitConfig(folder="var"))
    plans = [plan for part in frozen.values() for plan in part]
    plans += [generate(seed, f"seed_{seed}") for seed in SEEDS]
    plans += [generate(seed, f"home_{seed}", size="homes") for seed in SEEDS]
    return [(plan, build_grid(plan)) for plan in plans]


def pieces(homes: list[Home]) -> Iterator[tuple[FloorPlan, Grid, Room, Piece]]:
    for plan, grid in homes:
        for piece in plan.furniture:
            yield plan, grid, room_of(plan, piece), piece


def room_of(plan: FloorPlan, piece: Piece) -> Room:
    """The one room that the whole piece lies in."""
    x0, y0, x1, y1 = piece.bounds
    inside = [
        room
        for room in plan.rooms
        if x0 > room.x0 + 0.049
        and y0 > room.y0 + 0.049
        and x1 < room.x1 - 0.049
        and y1 < room.y1 - 0.049
    ]
    assert len(inside) == 1, f"{plan.name}: {piece} is in {len(inside)} rooms"
    return inside[0]


def apart(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    eps = 1e-6
    return a[2] <= b[0] + eps or b[2] <= a[0] + eps or a[3] <= b[1] + eps or b[3] <= a[1] + eps


def side(piece: Piece, heading: int) -> float:
    """Where the side of a piece that looks to `heading` lies on that axis."""
    x0, y0, x1, y1 = piece.bounds
    return (y1, x1, y0, x0)[heading]


def test_neighbouring_free_cells_have_no_wall_between(homes: list[Home]) -> None:
    """By the walls' centre lines: what crosses one does so in a doorway, and well inside it."""
    crossed = 0
    for plan, grid in homes:
        cells = {tuple(cell) for cell in grid.lattice.tolist()}
        for x, y in cells:
            for dx, dy in ((1, 0), (0, 1)):
                if (x + dx, y + dy) not in cells:
                    continue
                a, b = np.array([x, y]) * CELL, np.array([x + dx, y + dy]) * CELL
                for room in plan.rooms:
                    low, high = np.array([room.x0, room.y0]), np.array([room.x1, room.y1])
                    axis, other = (0, 1) if dx else (1, 0)
                    for line in (low[axis], high[axis]):
                        on_it = low[other] - 1e-6 <= a[other] <= high[other] + 1e-6
                        if not (on_it and a[axis] - 1e-6 <= line <= b[axis] + 1e-6):
                            continue
                        crossed += 1
                        assert any(
                            abs((d.x, d.y)[axis] - line) < 1e-6
                            and abs((d.x, d.y)[other] - a[other]) < 0.45 - 0.2
                            and d.along == "yx"[axis]
                            for d in plan.doorways
                        ), f"{plan.name}: a wall between {a} and {b}"
    # Four pairs at least for every doorway: on either side, from either room.
    assert crossed >= 4 * sum(len(plan.doorways) for plan, _ in homes)


def test_free_cells_keep_20_cm_from_furniture(homes: list[Home]) -> None:
    for plan, _, _, piece in pieces(homes):
        x0, y0, x1, y1 = piece.bounds
        grid = next(g for p, g in homes if p is plan)
        nearest = np.clip(grid.centres, (x0, y0), (x1, y1))
        assert np.linalg.norm(grid.centres - nearest, axis=1).min() > 0.2


def test_every_room_is_reached_and_the_cells_are_connected(homes: list[Home]) -> None:
    for plan, grid in homes:
        assert set(grid.rooms.tolist()) == set(range(len(plan.rooms)))
        assert grid.distances.min() == 0
        assert (grid.distances < grid.cells).all()


def test_no_door_opens_onto_furniture(homes: list[Home]) -> None:
    """Its leaf is 0.9 m wide and sweeps as much on either side; so does the front door's."""
    for plan, _ in homes:
        for door in plan.doorways:
            a, b = (0.45, 0.95) if door.along == "x" else (0.95, 0.45)
            swept = (door.x - a, door.y - b, door.x + a, door.y + b)
            for piece in plan.furniture:
                assert apart(swept, piece.bounds), f"{plan.name}: {piece} stands before {door}"
        (front,) = [p for p in plan.furniture if p.kind == "front_door"]
        dx, dy = FACING[front.heading]
        x0, y0, x1, y1 = front.bounds
        swept = (x0 + min(dx, 0) * 0.9, y0 + min(dy, 0) * 0.9, x1 + max(dx, 0) * 0.9,
                 y1 + max(dy, 0) * 0.9)  # fmt: skip
        for piece in plan.furniture:
            assert piece is front or apart(swept, piece.bounds), f"{plan.name}: {piece}"


def test_what_belongs_at_a_wall_touches_it_with_its_back(homes: list[Home]) -> None:
    found = Counter()
    for plan, _, room, piece in pieces(homes):
        if piece.kind in AT_THE_WALL:
            back = (piece.heading + 2) % 4
            wall = (room.y1 - 0.05, room.x1 - 0.05, room.y0 + 0.05, room.x0 + 0.05)[back]
            assert side(piece, back) == pytest.approx(wall, abs=1e-3), f"{plan.name}: {piece}"
            found[piece.kind] += 1
    assert min(found[kind] for kind in ("bed", "sofa", "counter", "toilet", "fridge")) >= 10


def test_chairs_face_a_table_and_can_be_reached(homes: list[Home]) -> None:
    chairs = 0
    for plan, grid, _, piece in pieces(homes):
        if piece.kind != "chair":
            continue
        chairs += 1
        dx, dy = FACING[piece.heading]
        before = np.array([piece.x + dx * 0.3, piece.y + dy * 0.3])
        tables = [p.bounds for p in plan.furniture if p.kind in ("dining_table", "desk")]
        assert any((before > table[:2]).all() and (before < table[2:]).all() for table in tables), (
            f"{plan.name}: {piece} faces no table"
        )
        x0, y0, x1, y1 = piece.bounds
        off = grid.centres - np.clip(grid.centres, (x0, y0), (x1, y1))
        assert np.linalg.norm(off, axis=1).min() <= CELL, f"{plan.name}: {piece} is out of reach"
    assert chairs >= 20


def test_what_is_used_from_the_front_has_a_free_cell_there(homes: list[Home]) -> None:
    """Nobody climbs over a table to open the fridge: within 0.75 m, before the piece."""
    used = {"fridge", "stove", "sink", "wardrobe", "toilet", "basin", "bathtub", "shower", "sofa"}
    for plan, grid, _, piece in pieces(homes):
        if piece.kind not in used:
            continue
        dx, dy = FACING[piece.heading]
        x0, y0, x1, y1 = piece.bounds
        low = (x0 - 0.25 + min(dx, 0) * 0.5, y0 - 0.25 + min(dy, 0) * 0.5)
        high = (x1 + 0.25 + max(dx, 0) * 0.5, y1 + 0.25 + max(dy, 0) * 0.5)
        near = ((grid.centres >= low) & (grid.centres <= high)).all(axis=1)
        ahead = (grid.centres - (piece.x, piece.y)) @ np.array([dx, dy]) > piece.depth / 2
        assert (near & ahead).any(), f"{plan.name}: nobody gets to the {piece.kind} at {piece}"


def test_the_sofa_sees_the_television(homes: list[Home]) -> None:
    for plan, _, room, sofa in pieces(homes):
        if sofa.kind != "sofa":
            continue
        (screen,) = [
            p for p in plan.furniture if p.kind == "television" and room_of(plan, p) is room
        ]
        assert screen.heading == (sofa.heading + 2) % 4
        way = np.array([screen.x - sofa.x, screen.y - sofa.y])
        along = float(way @ FACING[sofa.heading])
        assert 1.5 < along < 4.6
        assert abs(abs(way).sum() - along) < 0.3
        # Nothing higher than the seat stands in between.
        line = (min(sofa.x, screen.x) - 0.2, min(sofa.y, screen.y) - 0.2,
                max(sofa.x, screen.x) + 0.2, max(sofa.y, screen.y) + 0.2)  # fmt: skip
        for piece in plan.furniture:
            if piece.kind not in ("sofa", "television", "tv_stand", "coffee_table"):
                assert apart(line, piece.bounds), f"{plan.name}: {piece} hides the television"


def test_no_two_pieces_share_space(homes: list[Home]) -> None:
    for plan, _ in homes:
        for a, b in combinations(plan.furniture, 2):
            stacked = a.z + a.height <= b.z + 1e-6 or b.z + b.height <= a.z + 1e-6
            assert stacked or apart(a.bounds, b.bounds), f"{plan.name}: {a} and {b}"


def test_tall_pieces_hide_no_window(homes: list[Home]) -> None:
    for plan, _ in homes:
        for window in plan.windows:
            a, b = (window.width / 2, 0.3) if window.along == "x" else (0.3, window.width / 2)
            before = (window.x - a, window.y - b, window.x + a, window.y + b)
            for piece in plan.furniture:
                low = piece.z + piece.height <= window.sill + 1e-6
                assert low or apart(before, piece.bounds), f"{plan.name}: {piece} before {window}"


def test_rooms_hold_what_belongs_there(homes: list[Home]) -> None:
    for plan, _ in homes:
        held: dict[Room, set[str]] = {room: set() for room in plan.rooms}
        for piece in plan.furniture:
            held[room_of(plan, piece)].add(piece.kind)
        for room, kinds in held.items():
            assert kinds <= BELONGS[room.kind] | EVERYWHERE, f"{plan.name}: {room}"
            assert kinds >= NEEDS[room.kind], f"{plan.name}: {room}"
        assert any("dining_table" in kinds for kinds in held.values())
        assert any(kinds & {"bathtub", "shower"} for kinds in held.values())
        assert len(plan.lamps) == len(plan.rooms)
        for lamp, room in zip(plan.lamps, plan.rooms, strict=True):
            assert room.x0 < lamp.x < room.x1
            assert room.y0 < lamp.y < room.y1


def test_rooms_tile_and_are_in_proportion(homes: list[Home]) -> None:
    for plan, _ in homes:
        area = {room: (room.x1 - room.x0) * (room.y1 - room.y0) for room in plan.rooms}
        for a, b in combinations(plan.rooms, 2):
            assert apart((a.x0, a.y0, a.x1, a.y1), (b.x0, b.y0, b.x1, b.y1))
        for room in plan.rooms:
            short, long = sorted((room.x1 - room.x0, room.y1 - room.y0))
            assert long / short < 2.1
            if room.kind == "bathroom":
                assert area[room] == min(area.values())
            if room.kind == "living_room":
                assert area[room] >= max(area.values()) - 1.5
        # Everybody has daylight, except perhaps in the bath.
        for room in plan.rooms:
            lit = any(room.x0 <= w.x <= room.x1 and room.y0 <= w.y <= room.y1 for w in plan.windows)
            assert lit or room.kind == "bathroom"


def test_windows_are_in_outer_walls(homes: list[Home]) -> None:
    for plan, _ in homes:
        for window in plan.windows:
            half = window.width / 2
            for at in (-half, 0.0, half):
                x, y = (
                    (window.x + at, window.y) if window.along == "x" else (window.x, window.y + at)
                )
                touching = [
                    r
                    for r in plan.rooms
                    if r.x0 - 1e-6 <= x <= r.x1 + 1e-6 and r.y0 - 1e-6 <= y <= r.y1 + 1e-6
                ]
                assert len(touching) == 1, f"{plan.name}: {window} looks into another room"


def test_no_layout_is_a_copy_or_mirror(homes: list[Home]) -> None:
    keys = [layout_key(plan) for plan, _ in homes]
    assert len(set(keys)) == len(keys)


def test_sources_are_spread(homes: list[Home]) -> None:
    for plan, grid in homes:
        points = np.array(plan.sources)
        gaps = np.linalg.norm(points[:, None] - points[None], axis=2)
        assert gaps[np.triu_indices(len(points), 1)].min() >= 1.0
        rooms = {
            grid.rooms[np.flatnonzero((grid.centres == point).all(axis=1))[0]] for point in points
        }
        lived_in = {i for i, room in enumerate(plan.rooms) if room.kind != "bathroom"}
        assert rooms >= lived_in, f"{plan.name}: sources in rooms {rooms} alone"


def test_the_seed_decides() -> None:
    texts = [generate(seed, "home", 4, "small").to_json() for seed in (3, 3, 4)]
    assert texts[0] == texts[1] != texts[2]


def test_all_numbers_of_rooms_are_drawn(homes: list[Home]) -> None:
    assert {len(plan.rooms) for plan, _ in homes} == {3, 4, 5}


def test_a_plan_survives_its_file(homes: list[Home]) -> None:
    for plan, _ in homes[:3]:
        again = from_dict(plan.to_dict())
        assert again == plan


def test_bad_requests_are_named() -> None:
    with pytest.raises(UserError, match=r"split\.size is 'huge'; choose one of small"):
        generate(0, "home", size="huge")
    with pytest.raises(UserError, match="0 sources an apartment; ask for at least 1"):
        generate(0, "home", sources=0)
    with pytest.raises(UserError, match="500 sources asked for, room for"):
        generate(0, "home", sources=500, size="small")
    assert set(SIZES) >= {"small", "mixed", "large"}
