"""Results by difficulty of the start: distance, line of sight, rooms crossed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from avn.core.errors import UserError
from avn.navigation.metrics import cluster_bootstrap
from avn.reporting.trajectory_figures import RUN_COLOURS, figure_of

# Lower bounds of the groups of distances, metres.
DISTANCES = (0, 2, 4, 6, 8, 10)
KINDS = ("distance", "sight", "rooms")
TITLES = {
    "distance": "geodesic distance to the source, m",
    "sight": "source at the start",
    "rooms": "doorways between start and source",
}


def breakdown(episodes: pd.DataFrame, kind: str, draws: int = 1000) -> pd.DataFrame:
    """Compute success rate and SPL by one property of the start.

    Parameters
    ----------
    episodes : DataFrame
        Records as in `episodes.csv`.
    kind : {"distance", "sight", "rooms"}
        Property by which episodes are grouped.
    draws : int
        Bootstrap resamples over (scene, source) clusters.

    Returns
    -------
    DataFrame
        `group`, a label; `episodes`, their number; `sr` and `spl`, 0 to 1, with 95 % confidence
        intervals `sr_low`, `sr_high`, `spl_low`, `spl_high`. Empty groups are left out.

    Raises
    ------
    UserError
        If the kind is unknown.
    """
    if kind not in KINDS:
        raise UserError(f"breakdown: '{kind}' is none of {', '.join(KINDS)}")
    rows = []
    for name, part in episodes.groupby(_groups(episodes, kind), observed=True):
        values = part[["success", "spl"]].to_numpy(dtype=np.float64)
        clusters = part.groupby(["scene", "source"]).ngroup().to_numpy()
        means = values.mean(axis=0)
        low, high = cluster_bootstrap(values, clusters, draws=draws)
        row: dict[str, object] = {"group": str(name), "episodes": len(part)}
        for index, metric in enumerate(("sr", "spl")):
            row |= {metric: means[index], f"{metric}_low": low[index]}
            row[f"{metric}_high"] = high[index]
        rows.append(row)
    return pd.DataFrame(rows)


def _groups(episodes: pd.DataFrame, kind: str) -> pd.Series:
    """Return the group of each episode as an ordered categorical."""
    if kind == "sight":
        words = np.where(episodes["in_sight"] == 1, "in sight", "out of sight")
        order = ["in sight", "out of sight"]
    elif kind == "rooms":
        words = episodes["rooms_crossed"].clip(upper=3).astype(int).astype(str).to_numpy()
        words = np.where(words == "3", "3 or more", words)
        order = ["0", "1", "2", "3 or more"]
    else:
        at = np.searchsorted(DISTANCES, episodes["geodesic"].to_numpy(), side="right") - 1
        order = [f"{a} to {b}" for a, b in pairwise(DISTANCES)]
        order.append(f"{DISTANCES[-1]} or more")
        words = np.array(order)[at]
    return pd.Series(pd.Categorical(words, order, ordered=True), index=episodes.index)


def breakdown_figure(
    runs: Mapping[str, pd.DataFrame], colours: Sequence[str] = RUN_COLOURS
) -> Figure:
    """Draw success rate and SPL of runs by distance, sight and rooms crossed.

    Parameters
    ----------
    runs : mapping of str to DataFrame
        Records of each run by its name.
    colours : sequence of str
        Colours of the runs.

    Returns
    -------
    Figure
        Points with 95 % intervals, and the number of episodes under each group.
    """
    figure = figure_of(12.5, 6.4)
    panels = figure.subplots(2, len(KINDS), sharey="row", width_ratios=(2.4, 1, 1.5))
    for column, kind in enumerate(KINDS):
        tables = {name: breakdown(own, kind).set_index("group") for name, own in runs.items()}
        groups = list(next(iter(tables.values())).index)
        counts = next(iter(tables.values()))["episodes"]
        for row, title in enumerate(("sr", "spl")):
            axes = panels[row, column]
            for index, (name, table) in enumerate(tables.items()):
                own = table.reindex(groups)
                shift = 0.14 * (index - (len(tables) - 1) / 2)
                ends = own[[f"{title}_low", f"{title}_high"]].to_numpy(float).T
                off = np.abs(ends - own[title].to_numpy(float))
                axes.errorbar(
                    np.arange(len(groups)) + shift,
                    100 * own[title],
                    yerr=100 * off,
                    color=colours[index % len(colours)],
                    marker="o",
                    linestyle="-" if kind != "sight" else "none",
                    linewidth=1,
                    elinewidth=1.6,
                    markersize=5,
                    label=name,
                )
            labels = [f"{group}\n{counts[group]} ep." if row else "" for group in groups]
            axes.set_xticks(range(len(groups)), labels, fontsize=8)
            axes.set(ylim=(-3, 103), xlim=(-0.5, len(groups) - 0.5))
            axes.grid(alpha=0.3, axis="y")
            if row:
                axes.set_xlabel(TITLES[kind])
        panels[0, 0].set_ylabel("success rate, %")
        panels[1, 0].set_ylabel("SPL, %")
    handles, names = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=min(4, len(names)))
    return figure
