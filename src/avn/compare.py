"""`avn compare RUN RUN [RUN...]`: paired differences between runs over the same episodes.

RUN is a run's folder, or a run of `outputs`: the hash of its folder, or agent and hash, such as
greedy-a2b05ce3. Runs with commas between them, which differ in seed or train_seed only, are one
side: A1,A2,A3 B1,B2,B3. Every side is compared with every other one.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from avn.config.cli import plainly
from avn.core.errors import UserError

if TYPE_CHECKING:
    from avn.pipeline.run_sides import Side
    from avn.reporting.comparison import Comparison


class _Parser(argparse.ArgumentParser):
    """Parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        raise UserError(f"{message}; avn compare --help says more")


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare the runs and return the exit code."""
    return plainly("avn.compare", lambda: _compare(_parse(arguments)))


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = _Parser("avn compare", description=__doc__)
    parser.add_argument("runs", nargs="+", metavar="RUN", help="runs, with commas: one side")
    parser.add_argument(
        "--outputs", type=Path, default=Path("outputs"), help="folder of the outputs (outputs)"
    )
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write the differences as CSV too")
    options = parser.parse_args(arguments)
    for text in options.runs:
        if text.startswith("outputs="):
            raise UserError(f"{text}: no run; give --outputs {text.removeprefix('outputs=')}")
    if len(options.runs) < 2:
        raise UserError(f"RUN: {options.runs[0]} alone; give two runs or more")
    return options


def _compare(options: argparse.Namespace) -> None:
    import pandas as pd

    from avn.pipeline import run_sides
    from avn.reporting import comparison_table
    from avn.reporting.results import write_csv
    from avn.reporting.table import wide_console

    sides = [run_sides.open_side(text, options.outputs) for text in options.runs]
    # all pairs are compared before the first is printed, so that a refusal is the only line
    pairs = [(*pair, run_sides.compare_sides(*pair)) for pair in combinations(sides, 2)]
    if options.csv:
        rows = [comparison_table.csv_rows(found, a.given, b.given) for a, b, found in pairs]
        write_csv(pd.concat(rows), options.csv)
    for one, other, found in pairs:
        _print(one, other, run_sides.differences(one, other), found)
    for note in dict.fromkeys(
        note for *_, found in pairs for note in comparison_table.notes(found)
    ):
        wide_console().print(note, style="dim", highlight=False, markup=False)


def _print(one: Side, other: Side, differing: Sequence[str], found: Comparison) -> None:
    from avn.reporting import comparison_table
    from avn.reporting.table import wide_console

    console = wide_console()
    for letter, side in (("A", one), ("B", other)):
        console.print(f"{letter}  {_title(side)}", style="bold", highlight=False, markup=False)
    if differing:
        text = f"A / B: {'; '.join(differing)}"
        console.print(text, highlight=False, markup=False)
    apartments = "1 apartment" if found.scenes == 1 else f"{found.scenes} apartments"
    each = " with each network" if found.networks > 1 else ""
    console.print(f"{found.episodes} episodes{each} in {apartments}", highlight=False)
    console.print(comparison_table.comparison_table(found))
    for letter, side in (("A", one), ("B", other)):
        if found.networks > 1 and len(side.networks) == 1:
            console.print(f"One network of {letter}: the result is of this network only.")
    console.print(comparison_table.mcnemar_line(found), highlight=False, markup=False)
    console.print()


def _title(side: Side) -> str:
    """Return the agent, seeds and networks of a side."""
    seeds, networks = (", ".join(map(str, values)) for values in (side.seeds, side.networks))
    words = [
        f"{name}{'s' if ',' in values else ''} {values}"
        for name, values in (("seed", seeds), ("train_seed", networks))
    ]
    return f"{side.name} ({'; '.join(words)})"


if __name__ == "__main__":
    sys.exit(main())
