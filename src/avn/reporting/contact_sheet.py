"""Contact sheets: labelled views of an apartment in a grid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import Grid

_HEADINGS = "NESW"
_LINE = 12
COLUMNS = 8


def sheet_states(plan: FloorPlan, grid: Grid, places: int = 2) -> list[int]:
    """Choose states that show every room: all headings at some distant cells.

    Parameters
    ----------
    plan : FloorPlan
    grid : Grid
    places : int
        Cells per room. The first is the most central, each further one the farthest from those
        before.

    Returns
    -------
    list of int
        4 x cell + heading, four headings per cell.
    """
    chosen = []
    for room in range(len(plan.rooms)):
        cells = np.flatnonzero(grid.rooms == room)
        if not len(cells):
            continue
        middle = grid.centres[cells].mean(axis=0)
        picked = [int(cells[np.linalg.norm(grid.centres[cells] - middle, axis=1).argmin()])]
        while len(picked) < min(places, len(cells)):
            away = np.linalg.norm(grid.centres[cells][:, None] - grid.centres[picked][None], axis=2)
            picked.append(int(cells[away.min(axis=1).argmax()]))
        chosen += picked
    return [4 * cell + heading for cell in chosen for heading in range(4)]


def contact_sheet(
    plan: FloorPlan, grid: Grid, states: list[int], pictures: NDArray[np.uint8]
) -> Image.Image:
    """Draw a grid of labelled views.

    Parameters
    ----------
    plan : FloorPlan
    grid : Grid
    states : list of int
        N states, 4 x cell + heading.
    pictures : (N, H, W, 3) uint8
        Their views, sRGB.
    """
    high, wide = pictures.shape[1:3]
    rows = -(-len(states) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * (wide + 2), rows * (high + _LINE + 2)), "white")
    pen = ImageDraw.Draw(sheet)
    for n, (state, picture) in enumerate(zip(states, pictures, strict=True)):
        left, top = n % COLUMNS * (wide + 2), n // COLUMNS * (high + _LINE + 2)
        sheet.paste(Image.fromarray(picture), (left, top + _LINE))
        cell, heading = divmod(state, 4)
        room = plan.rooms[grid.rooms[cell]].kind.replace("_", " ")
        pen.text((left + 1, top), f"{state} {_HEADINGS[heading]} {room}", fill="black")
    return sheet


def save_contact_sheet(
    plan: FloorPlan, grid: Grid, pictures: NDArray[np.uint8], path: Path
) -> None:
    """Write the contact sheet of all rooms as a PNG.

    Parameters
    ----------
    plan : FloorPlan
    grid : Grid
    pictures : (S, H, W, 3) uint8
        Views of all states, sRGB.
    path : Path
    """
    states = sheet_states(plan, grid)
    contact_sheet(plan, grid, states, np.asarray(pictures)[states]).save(path)
