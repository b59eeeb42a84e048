"""Figures of floor plans."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from PIL import Image

from avn.apartments.floor_plan import (
    DOOR_WIDTH,
    WALL_THICKNESS,
    Doorway,
    FloorPlan,
    Piece,
    Room,
    Window,
)
from avn.apartments.grid import Grid, build_grid, source_cells
from avn.apartments.surfaces import walls

ROOM_COLOURS = {
    "kitchen": "#f6ead2",
    "bedroom": "#e4e6f4",
    "living_room": "#f3e3dc",
    "bathroom": "#dceef0",
}
MATERIAL_COLOURS = {
    "wood": "#c9a06c",
    "laminate": "#d9cbb5",
    "mattress": "#aab6da",
    "upholstery": "#c58f86",
    "fabric": "#9fb88f",
    "ceramic": "#ffffff",
    "metal": "#b9bec4",
    "glass": "#a9d3e6",
    "books": "#a67c63",
}
# Left, bottom, right and top in metres.
Box = tuple[float, float, float, float]
HEADINGS = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])
_INCHES_A_METRE = 1.05
_DPI = 100


def draw_floor_plan(axes: Axes, plan: FloorPlan, grid: Grid | None = None) -> None:
    """Draw rooms, walls, doorways, windows, furniture, cells and sources, in metres.

    Parameters
    ----------
    axes : Axes
    plan : FloorPlan
    grid : Grid, optional
        Built from the plan by default.
    """
    grid = build_grid(plan) if grid is None else grid
    for room in plan.rooms:
        corner, size = (room.x0, room.y0), (room.x1 - room.x0, room.y1 - room.y0)
        axes.add_patch(Rectangle(corner, *size, color=ROOM_COLOURS[room.kind], zorder=0))
    for x0, y0, x1, y1 in walls(plan):
        axes.add_patch(
            Rectangle((x0, y0), x1 - x0, y1 - y0, facecolor="#333333", linewidth=0, zorder=3)
        )
    _draw_openings(axes, plan)
    # Wall-mounted pieces are drawn as outlines over those on the floor.
    for piece in sorted(plan.furniture, key=lambda piece: piece.z):
        _draw_piece(axes, piece)
    _draw_grid(axes, plan, grid)
    taken = [piece.bounds for piece in plan.furniture]
    taken += [
        (x - 0.2, y - 0.2, x + 0.2, y + 0.2) for x, y in grid.centres[source_cells(plan, grid)]
    ]
    for room in plan.rooms:
        _draw_name(axes, room, taken)
    x0, y0 = (min(getattr(r, k) for r in plan.rooms) for k in ("x0", "y0"))
    x1, y1 = (max(getattr(r, k) for r in plan.rooms) for k in ("x1", "y1"))
    axes.set(xlim=(x0 - 0.2, x1 + 0.2), ylim=(y0 - 0.2, y1 + 0.2), aspect="equal")
    axes.tick_params(labelsize=7)
    axes.set_title(
        f"{plan.name}: {grid.cells} cells, {grid.squares} squares, {len(plan.sources)} sources",
        fontsize=9,
    )


def _draw_name(axes: Axes, room: Room, taken: Sequence[Box]) -> None:
    """Write a room's name where it covers the least furniture and no source, corners first."""
    name = room.kind.replace("_", " ")
    # a letter is about half as wide as the font size of 8; a point is 1/72 inch
    width = 0.55 * 8 * len(name) / 72 / _INCHES_A_METRE
    height = 1.2 * 8 / 72 / _INCHES_A_METRE
    lefts = np.linspace(room.x0 + 0.12, max(room.x0 + 0.12, room.x1 - 0.12 - width), 9)
    tops = np.linspace(room.y1 - 0.12, room.y0 + 0.12 + height, 17)
    places = [(x, y) for y in tops for x in lefts]
    covered = [_overlap((x, y - height, x + width, y), taken) for x, y in places]
    x, y = places[int(np.argmin(np.round(covered, 4)))]
    axes.text(x, y, name, va="top", fontsize=8, style="italic", color="#666666", zorder=6)


def _overlap(box: Box, others: Sequence[Box]) -> float:
    """Return the area of a box that others cover, in square metres."""
    x0, y0, x1, y1 = box
    return sum(
        max(0.0, min(x1, other[2]) - max(x0, other[0]))
        * max(0.0, min(y1, other[3]) - max(y0, other[1]))
        for other in others
    )


def _draw_openings(axes: Axes, plan: FloorPlan) -> None:
    openings: list[tuple[Doorway | Window, float, str, int]]
    openings = [(d, DOOR_WIDTH, "#ffffff", 2) for d in plan.doorways]
    openings += [(w, w.width, "#6fb7dd", 4) for w in plan.windows]
    for opening, width, colour, layer in openings:
        a, b = width / 2, WALL_THICKNESS / 2
        if opening.along == "y":
            a, b = b, a
        corner = (opening.x - a, opening.y - b)
        axes.add_patch(Rectangle(corner, 2 * a, 2 * b, facecolor=colour, linewidth=0, zorder=layer))


def _draw_piece(axes: Axes, piece: Piece) -> None:
    x0, y0, x1, y1 = piece.bounds
    hangs = piece.z > 0
    axes.add_patch(
        Rectangle(
            (x0, y0),
            x1 - x0,
            y1 - y0,
            facecolor="none" if hangs else MATERIAL_COLOURS.get(piece.material, "#cccccc"),
            edgecolor="#555555",
            linestyle=":" if hangs else "-",
            linewidth=0.7,
            zorder=4,
        )
    )
    if hangs:
        return
    # A tick towards the front side, and the kind along the longer side.
    front = HEADINGS[piece.heading] * piece.depth / 2
    axes.plot(
        [piece.x + front[0] * 0.55, piece.x + front[0]],
        [piece.y + front[1] * 0.55, piece.y + front[1]],
        color="#c0392b",
        linewidth=1.4,
        zorder=5,
    )
    longer = max(x1 - x0, y1 - y0)
    axes.text(
        piece.x,
        piece.y,
        piece.kind.replace("_", " "),
        ha="center",
        va="center",
        rotation=90 if y1 - y0 > x1 - x0 + 1e-6 else 0,
        # A letter is about 0.6 times as wide as the font size; a point is 1/72 inch.
        fontsize=min(7.0, 72 * _INCHES_A_METRE * longer / (0.6 * len(piece.kind))),
        zorder=6,
    )


def _draw_grid(axes: Axes, plan: FloorPlan, grid: Grid) -> None:
    centres = grid.centres
    for heading in (0, 1):
        starts = np.flatnonzero(grid.neighbours[:, heading] >= 0)
        ends = grid.neighbours[starts, heading]
        axes.plot(
            np.stack([centres[starts, 0], centres[ends, 0]]),
            np.stack([centres[starts, 1], centres[ends, 1]]),
            color="#8c8c8c",
            linewidth=0.4,
            zorder=1,
        )
    axes.plot(*centres.T, ".", color="#7a7a7a", markersize=3, zorder=5)
    cells = source_cells(plan, grid)
    axes.plot(*centres[cells].T, "*", color="#d62728", markersize=9, zorder=7)


def floor_plan_figure(plan: FloorPlan, grid: Grid | None = None) -> Figure:
    """Draw a figure of a floor plan at a fixed scale; the grid is built from it by default."""
    width = max(r.x1 for r in plan.rooms) - min(r.x0 for r in plan.rooms) + 1.0
    height = max(r.y1 for r in plan.rooms) - min(r.y0 for r in plan.rooms) + 1.0
    figure = Figure(figsize=(width * _INCHES_A_METRE, height * _INCHES_A_METRE), dpi=_DPI)
    FigureCanvasAgg(figure)
    draw_floor_plan(figure.add_subplot(), plan, grid)
    figure.tight_layout(pad=0.3)
    return figure


def save_floor_plan(plan: FloorPlan, path: Path, grid: Grid | None = None) -> None:
    """Write a floor plan as a PNG with a palette of 48 colours; missing folders are created.

    The file has no date or version, so that equal plans give equal bytes.

    Parameters
    ----------
    plan : FloorPlan
    path : Path
    grid : Grid, optional
        Built from the plan by default.
    """
    buffer = io.BytesIO()
    floor_plan_figure(plan, grid).savefig(buffer, format="png", metadata={"Software": None})
    buffer.seek(0)
    path.parent.mkdir(parents=True, exist_ok=True)
    with Image.open(buffer) as image:
        image.convert("RGB").quantize(48, dither=Image.Dither.NONE).save(path, optimize=True)
