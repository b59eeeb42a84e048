"""Results by difficulty of the start: distance, line of sight, rooms crossed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from avn.core.errors import UserError
from avn.reporting.bootstrap import DRAWS, estimate
from avn.reporting.nesting import nested
from avn.reporting.trajectory_figures import RUN_COLOURS, figure_of

# Lower bounds of the groups of distances, metres.
DISTANCES = (0, 2, 4, 6, 8, 10)
KINDS = ("distance", "sight", "rooms")
# Width of the legend in letters.
_LEGEND_WIDTH = 130
TITLES = {
    "distance": "geodesic distance to the source, m",
    "sight": "source at the start",
    "rooms": "doorways between start and source",
}


def breakdown(episodes: pd.DataFrame, kind: str, draws: int = DRAWS) -> pd.DataFrame:
    """Compute success rate and SPL by one property of the start.

    Parameters
    ----------
    episodes : DataFrame
        Records as in `episodes.csv`.
    kind : {"distance", "sight", "rooms"}
        Property by which episodes are grouped.
    draws : int
        Bootstrap resamples; 0 for no intervals.

    Returns
    -------
    DataFrame
        `group`, a label; `episodes`, their number; `sr` and `spl`, 0 to 1, means over episodes,
        with the 95 % intervals `sr_low`, `sr_high`, `spl_low`, `spl_high` of
        `avn.reporting.bootstrap`, NaN with too few apartments. Empty groups are left out.

    Raises
    ------
    UserError
        If the kind is unknown.
    """
    if kind not in KINDS:
        raise UserError(f"breakdown: '{kind}' is none of {', '.join(KINDS)}")
    rows = []
    for name, part in episodes.groupby(_groups(episodes, kind), observed=True):
        found = estimate(nested(part, ["success", "spl"]), equal=False, draws=draws)
        row: dict[str, object] = {"group": str(name), "episodes": len(part)}
        for index, metric in enumerate(("sr", "spl")):
            row |= {metric: found.mean[index], f"{metric}_low": found.low[index]}
            row[f"{metric}_high"] = found.high[index]
        rows.append(row)
    return pd.DataFrame(rows)


def _order(kind: str) -> list[str]:
    """Return all groups of a kind in order."""
    if kind == "sight":
        return ["in sight", "out of sight"]
    if kind == "rooms":
        return ["0", "1", "2", "3 or more"]
    return [*(f"{a} to {b}" for a, b in pairwise(DISTANCES)), f"{DISTANCES[-1]} or more"]


def _groups(episodes: pd.DataFrame, kind: str) -> pd.Series:
    """Return the group of each episode as an ordered categorical."""
    order = _order(kind)
    if kind == "sight":
        at = 1 - episodes["in_sight"].to_numpy(dtype=np.int64)
    elif kind == "rooms":
        at = episodes["rooms_crossed"].clip(upper=3).to_numpy(dtype=np.int64)
    else:
        at = np.searchsorted(DISTANCES, episodes["geodesic"].to_numpy(), side="right") - 1
    words = np.array(order)[at]
    return pd.Series(pd.Categorical(words, order, ordered=True), index=episodes.index)


def breakdown_figure(
    runs: Mapping[str, pd.DataFrame], colours: Sequence[str] = RUN_COLOURS, caption: str = ""
) -> Figure:
    """Draw success rate and SPL of runs by distance, sight and rooms crossed.

    Parameters
    ----------
    runs : mapping of str to DataFrame
        Records of each run by its name.
    colours : sequence of str
        Colours of the runs.
    caption : str
        World of the runs, below the figure.

    Returns
    -------
    Figure
        Points with 95 % intervals, for the groups that any run has, and the number of episodes
        under each group. The meaning of the intervals stands above the caption.
    """
    meaning = "Lines: 95 %, apartments, sources and episodes resampled."
    figure = figure_of(12.5, 6.4 + 0.25 * len(runs), "\n".join(filter(None, (meaning, caption))))
    panels = figure.subplots(2, len(KINDS), sharey="row", width_ratios=(2.4, 1, 1.5))
    for column, kind in enumerate(KINDS):
        tables = [breakdown(own, kind).set_index("group") for own in runs.values()]
        groups = [name for name in _order(kind) if any(name in own.index for own in tables)]
        tables = [own.reindex(groups) for own in tables]
        for axes, metric in zip(panels[:, column], ("sr", "spl"), strict=True):
            _draw_groups(axes, tables, list(runs), metric, kind, colours)
        counts = np.stack([own["episodes"].fillna(0).to_numpy(np.int64) for own in tables])
        labels = [f"{group}\n{_count(own)}" for group, own in zip(groups, counts.T, strict=True)]
        panels[0, column].set_xticklabels([])
        panels[1, column].set_xticklabels(labels, fontsize=8)
        panels[1, column].set_xlabel(TITLES[kind])
    panels[0, 0].set_ylabel("success rate, %")
    panels[1, 0].set_ylabel("SPL, %")
    handles, names = panels[0, 0].get_legend_handles_labels()
    columns = max(1, min(len(names), _LEGEND_WIDTH // max(map(len, names))))
    figure.legend(handles, names, loc="outside upper left", ncols=columns, frameon=False)
    return figure


def _draw_groups(
    axes: Axes,
    tables: Sequence[pd.DataFrame],
    names: Sequence[str],
    metric: str,
    kind: str,
    colours: Sequence[str],
) -> None:
    """Draw a metric of each run by group, with intervals where there are enough apartments.

    Parameters
    ----------
    axes : Axes
    tables : sequence of DataFrame
        `breakdown` of each run, with the same groups.
    names : sequence of str
        Names of the runs.
    metric : {"sr", "spl"}
    kind : str
        Kind of the groups.
    colours : sequence of str
        Colours of the runs.
    """
    for index, (name, table) in enumerate(zip(names, tables, strict=True)):
        values = table[metric].to_numpy(float)
        ends = table[[f"{metric}_low", f"{metric}_high"]].to_numpy(float).T
        shift = min(0.14, 0.6 / len(tables)) * (index - (len(tables) - 1) / 2)
        axes.errorbar(
            np.arange(len(table)) + shift,
            100 * values,
            yerr=100 * np.abs(ends - values),
            color=colours[index % len(colours)],
            marker="o",
            linestyle="-" if kind != "sight" else "none",
            linewidth=1,
            elinewidth=1.6,
            markersize=5,
            label=name,
        )
    axes.set(ylim=(-3, 103), xlim=(-0.5, len(tables[0]) - 0.5), xticks=range(len(tables[0])))
    axes.grid(alpha=0.3, axis="y")


def _count(episodes: NDArray[np.int64]) -> str:
    """Describe the number of episodes of a group in each run."""
    low, high, each = int(episodes.min()), int(episodes.max()), "\nper run"
    text = f"{low} to {high}" if low < high else str(low)
    return f"{text} episode" + ("" if high == 1 else "s") + ("" if len(episodes) == 1 else each)
