"""Tables of comparisons, for the terminal and as CSV."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from typing import Any

import pandas as pd
from rich.table import Table

from avn.reporting.comparison import INDEPENDENT, Comparison, McNemar
from avn.reporting.results import NO_INTERVAL

# Names of the metrics; all but the distance are in percent.
NAMES = {
    "sr": "success",
    "spl": "SPL",
    "softspl": "SoftSPL",
    "sna": "SNA",
    "dtg": "distance, m",
    "sna_goal": "SNA to the goal",
}
_METRES = "dtg"


def comparison_table(found: Comparison, one: str = "A", other: str = "B") -> Table:
    """Tabulate the metrics of both sides, their differences, intervals and smallest differences.

    Parameters
    ----------
    found : Comparison
        Comparison of two sides.
    one, other : str
        Short names of the sides.
    """
    table = Table(box=None, pad_edge=False, title_justify="left")
    table.add_column("%", no_wrap=True)
    heads = (one, other, f"{one} - {other}", "95 % interval", "smallest shown")
    for head in (*heads, *(["sd between networks"] if found.networks > 1 else [])):
        table.add_column(head, justify="right", no_wrap=True)
    for row in found.table.to_dict("records"):
        table.add_row(NAMES[str(row["metric"])], *_cells(row, found.networks > 1))
    return table


def _cells(row: Mapping[Hashable, Any], networks: bool) -> list[str]:
    metres = row["metric"] == _METRES
    scale, digits = (1.0, 2) if metres else (100.0, 1)

    def shown(key: str, sign: str = "") -> str:
        value = scale * row[key]
        return "-" if math.isnan(value) else f"{value:{sign}.{digits}f}"

    ends = "-" if math.isnan(float(row["low"])) else f"{shown('low', '+')} to {shown('high', '+')}"
    cells = [shown("one"), shown("other"), shown("difference", "+"), ends, shown("detectable")]
    return [*cells, shown("spread")] if networks else cells


def mcnemar_line(found: Comparison, one: str = "A", other: str = "B") -> str:
    """Return the result of McNemar's test in words.

    Parameters
    ----------
    found, one, other
        As those of `comparison_table`.
    """
    test = found.mcnemar
    if test is None:
        return "McNemar's test needs one network of each side: success is averaged over networks."
    return (
        f"McNemar's exact test of success: only {one} succeeds in {test.only_one} episodes, only "
        f"{other} in {test.only_other}; {p_text(test)}."
    )


def notes(found: Comparison) -> list[str]:
    """Return the lines that say what the columns of a table mean."""
    if found.table["low"].isna().all():
        lines = [f"No interval and no smallest difference: {NO_INTERVAL}."]
    else:
        lines = [
            f"95 % interval: {found.over} resampled, over the same episodes.",
            "Smallest shown: least true difference that so many apartments and episodes show with "
            "a power of 80 % (at 5 %, two-sided).",
        ]
    if found.networks > 1:
        lines.append(f"Mean over {found.networks} networks, sd between networks.")
    else:
        lines.append("One network of each side: the result is of these networks only.")
    return lines if found.mcnemar is None else [*lines, f"{INDEPENDENT}."]


def p_text(test: McNemar) -> str:
    """Format a p-value."""
    return "p < 0.0001" if test.p < 1e-4 else f"p = {test.p:.4f}"


def line(found: Comparison, one: str, other: str) -> str:
    """Describe a comparison in one line: SPL, success and McNemar's test.

    Parameters
    ----------
    found : Comparison
        Comparison of two sides.
    one, other : str
        Names of the sides.
    """
    rows = found.table.set_index("metric").to_dict("index")
    parts = []
    for metric in ("sr", "spl"):
        row = {key: 100 * float(value) for key, value in rows[metric].items()}
        text = f"{NAMES[metric]} {row['difference']:+.1f} points"
        if not math.isnan(row["low"]):
            text += f" ({row['low']:+.1f} to {row['high']:+.1f}, smallest shown "
            text += f"{row['detectable']:.1f})"
        parts.append(text)
    if math.isnan(rows["sr"]["low"]):
        parts.append(NO_INTERVAL)
    else:
        parts.append(f"95 %, {found.over} resampled")
    if found.mcnemar is not None:
        parts.append(f"McNemar, episodes as independent, {p_text(found.mcnemar)}")
    return f"{one} less {other}: {'; '.join(parts)}"


def csv_rows(found: Comparison, one: str, other: str) -> pd.DataFrame:
    """Return a comparison as rows of a CSV file, one per metric.

    Parameters
    ----------
    found : Comparison
        Comparison of two sides.
    one, other : str
        Names of the sides, for the columns `a` and `b`.
    """
    test = found.mcnemar
    rows = found.table.rename(columns={"one": "mean_a", "other": "mean_b"})
    rows.insert(0, "a", one)
    rows.insert(1, "b", other)
    counts = {"episodes": found.episodes, "scenes": found.scenes, "networks": found.networks}
    own = rows["metric"] == "sr"
    tests = {
        "only_a": test.only_one if test else math.nan,
        "only_b": test.only_other if test else math.nan,
        "mcnemar_p": test.p if test else math.nan,
    }
    return rows.assign(
        **counts, **{key: pd.Series(value, rows.index).where(own) for key, value in tests.items()}
    )
