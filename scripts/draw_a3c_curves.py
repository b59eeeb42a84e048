"""Draw the learning curves of trained actor-critics; networks of one row as mean and range.

python scripts/draw_a3c_curves.py outputs/train/a3c_* --output docs/a3c_curves.png
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

PARTS = ("train", "validation")
# The paper's order; other rows come after.
ROWS = ("a3c_v", "a3c_va", "a3c_va_mapper", "a3c_va_m", "a3c_va_m_mapper")


def read(folders: list[Path]) -> dict[str, list[list[dict[str, float]]]]:
    """Read the curves of each row, by its name."""
    found: dict[str, list[list[dict[str, float]]]] = {row: [] for row in ROWS}
    for folder in folders:
        row = folder.name.rpartition("-")[0]
        found.setdefault(row, []).append(json.loads((folder / "curve.json").read_text()))
    return {row: curves for row, curves in found.items() if curves}


def draw(rows: dict[str, list[list[dict[str, float]]]]) -> Figure:
    """Draw SPL on training and on validation apartments against steps."""
    figure = Figure(figsize=(8, 3), layout="constrained")
    both = figure.subplots(1, 2, sharey=True)
    for axes, part in zip(both, PARTS, strict=True):
        for row, curves in rows.items():
            points = min(map(len, curves))
            steps = [own["steps"] / 1e6 for own in curves[0][:points]]
            spl = np.array([[100 * p[f"{part}/spl"] for p in own[:points]] for own in curves])
            (line,) = axes.plot(steps, spl.mean(0), label=row)
            if len(curves) > 1:
                axes.fill_between(steps, spl.min(0), spl.max(0), alpha=0.2, color=line.get_color())
        axes.set(title=f"{part} apartments", xlabel="million steps")
        axes.grid(alpha=0.3)
    both[0].set_ylabel("SPL, %")
    both[1].legend(fontsize=7)
    return figure


def main() -> None:
    """Read, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--output", type=Path, default=Path("a3c_curves.png"))
    options = parser.parse_args()
    draw(read(options.folders)).savefig(options.output, dpi=100)


if __name__ == "__main__":
    main()
