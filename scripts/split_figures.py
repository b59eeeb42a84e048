"""Print the table of `docs/dataset.md` that compares the apartments of two splits.

Size, fullness and difficulty of the validation and test apartments of `homes` and `var`, as mean,
standard deviation and range over apartments. Random search is exact, under `protocol=var` with
`protocol.cap=source` (see `hardness.py`). Run from the repository:

    python scripts/split_figures.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml
from hardness import hardness

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import build_grid
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import load_split

CONFIGS = Path(__file__).parents[1] / "conf" / "split"
SPLITS, PARTS = ("homes", "var"), ("test", "validation")


def figures(plan: FloorPlan) -> dict[str, float]:
    """Return the rows of the table for an apartment."""
    grid = build_grid(plan)
    measured = hardness(plan, grid)
    return {
        "rooms": len(plan.rooms),
        "free cells": grid.cells,
        "squares that are free, %": 100 * grid.cells / grid.squares,
        "random search, success, %": 100 * measured.success,
        "random search, SPL, %": 100 * measured.spl,
        "starts in sight of the source, %": 100 * (1 - measured.out_of_sight),
        "starts in another room, %": 100 * measured.other_room,
        "geodesic / straight distance": measured.detour,
    }


def text(values: list[float]) -> str:
    """Format mean, standard deviation and range."""
    digits = 2 if max(values) < 5 else 1
    mean, spread = np.mean(values), np.std(values, ddof=1)
    low, high = min(values), max(values)
    return f"{mean:.{digits}f} ± {spread:.{digits}f}, {low:.{digits}f} to {high:.{digits}f}"


def main() -> None:
    """Print the table."""
    columns: dict[str, list[dict[str, float]]] = {}
    for part in PARTS:
        for name in SPLITS:
            values = yaml.safe_load((CONFIGS / f"{name}.yaml").read_text(encoding="utf-8"))
            rows = [figures(plan) for plan in load_split(SplitConfig(**values))[part]]
            columns[f"`{name}`, {len(rows)} {part}"] = rows
    print(f"| mean ± standard deviation, range | {' | '.join(columns)} |")
    print("| --- " * (len(columns) + 1) + "|")
    for key in next(iter(columns.values()))[0]:
        cells = [text([row[key] for row in rows]) for rows in columns.values()]
        print(f"| {key} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
