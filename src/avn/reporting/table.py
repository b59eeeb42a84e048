"""Terminal tables of results by scene and sound in the layout of the paper."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table
from rich.text import Text

from avn.reporting.paper import PAPER, paper_results
from avn.reporting.results import ALL_SOUNDS, AVERAGE, DYNAMIC_HEADINGS, USUAL_LOOK, shown_scenes


def results_table(
    results: pd.DataFrame,
    privileged: Collection[str] = (),
    paper: Mapping[str, Collection[str]] = MappingProxyType({}),
) -> Table:
    """Tabulate success rate / SPL in %, with rows of agents and sounds and columns of scenes.

    Results of several seeds are averaged. Metrics of worlds that change in the course of an episode
    follow, over all sounds.

    Parameters
    ----------
    results : DataFrame
        As in `results.csv`.
    privileged : collection of str
        Agents that are marked as upper bounds.
    paper : mapping of str to collection of str
        Sounds by agent whose results are followed by those of the paper; see
        `avn.reporting.paper.paper_results`.
    """
    scenes = shown_scenes(results)
    table = Table(title="success rate / SPL, %", box=None, pad_edge=False, title_justify="left")
    table.add_column("", no_wrap=True)
    for scene in scenes:
        table.add_column(readable(scene), justify="right", no_wrap=True)
    papers = paper_results(paper).set_index(["agent", "sound", "scene"])
    columns = ["agent", "protocol", "acoustics", "look"]
    for keys, run in results.groupby(columns, sort=False):
        names = [str(key) for key in keys]
        names = names[:-1] if names[-1] == USUAL_LOOK else names
        mark = " (privileged: upper bound)" if names[0] in privileged else ""
        table.add_row(Text(f"{' · '.join(names)}{mark}", style="bold"))
        for sound, part in run.groupby("sound", sort=False):
            means = 100.0 * part.groupby("scene", sort=False)[["sr", "spl"]].mean()
            table.add_row(f"  {sound}", *_cells(means, scenes))
            own = papers.loc[papers.index.isin([(names[0], sound, s) for s in scenes])]
            if len(own):
                cells = _cells(own.droplevel(["agent", "sound"]), scenes)
                table.add_row(f"    {PAPER}", *cells, style="dim")
        for heading, values in _dynamic(run, scenes):
            table.add_row(f"    {heading}", *values, style="dim")
    return table


def hardness(episodes: pd.DataFrame) -> pd.DataFrame:
    """Compute the difficulty of the starts by scene and, of several scenes, on average.

    Returns
    -------
    DataFrame
        `scene`; `episodes`, their number; `other_room`, the share of starts in another room than
        the source; `out_of_sight`, the share without line of sight to it; `detour`, the mean
        ratio of geodesic to Euclidean distance; `geodesic`, the mean distance in metres.
    """
    described = pd.DataFrame(
        {
            "scene": episodes["scene"],
            "other_room": (episodes["rooms_crossed"] > 0).astype(float),
            "out_of_sight": 1.0 - episodes["in_sight"].astype(float),
            "detour": episodes["geodesic"] / episodes["euclidean"],
            "geodesic": episodes["geodesic"],
        }
    )
    groups = described.groupby("scene", sort=False)
    table = groups.mean()
    table.insert(0, "episodes", groups.size())
    if len(table) > 1:
        average = table.mean()
        average["episodes"] = len(episodes)
        table.loc[AVERAGE] = average
    return table.reset_index().astype({"episodes": np.int64})


def hardness_table(episodes: pd.DataFrame) -> Table:
    """Format `hardness` as a table for the terminal."""
    table = Table(title="difficulty of the starts", box=None, pad_edge=False, title_justify="left")
    table.add_column("", no_wrap=True)
    for title in ("starts", "in another room", "out of sight", "geodesic / Euclidean", "geodesic"):
        table.add_column(title, justify="right", no_wrap=True)
    described = hardness(episodes).set_index("scene")
    shares = described[["other_room", "out_of_sight", "detour", "geodesic"]].to_numpy(np.float64)
    for scene, count, row in zip(described.index, described["episodes"], shares, strict=True):
        other, hidden, detour, geodesic = row
        cells = (f"{100 * other:.0f} %", f"{100 * hidden:.0f} %", f"{detour:.2f}")
        table.add_row(readable(str(scene)), str(count), *cells, f"{geodesic:.1f} m")
    return table


def print_tables(
    results: pd.DataFrame,
    episodes: pd.DataFrame,
    console: Console | None = None,
    privileged: Collection[str] = (),
    paper: Mapping[str, Collection[str]] = MappingProxyType({}),
    caption: str = "",
) -> None:
    """Print the results and the difficulty of the starts.

    Parameters
    ----------
    results : DataFrame
        As in `results.csv`.
    episodes : DataFrame
        As in `episodes.csv`.
    console : Console, optional
        `wide_console()` by default.
    privileged, paper
        As those of `results_table`.
    caption : str
        World of the results, below each heading.
    """
    console = console or wide_console()
    print_table(results_table(results, privileged, paper), caption, console)
    print_table(hardness_table(episodes), caption, console)


def print_table(table: Table, caption: str = "", console: Console | None = None) -> None:
    """Print a table below its heading and a caption, which may be wider than the table.

    Parameters
    ----------
    table : Table
        Table, of which the title is printed as the heading.
    caption : str
        Lines below the heading.
    console : Console, optional
        `wide_console()` by default.
    """
    console = console or wide_console()
    title, table.title = table.title, None
    console.print(Text(str(title), style="italic"))
    if caption:
        console.print(Text(caption, style="dim"))
    console.print(table)
    console.print()


def wide_console() -> Console:
    """Create a console that is 120 characters wide if the output is a file or a pipe."""
    console = Console()
    return console if console.is_terminal else Console(width=120)


def _cells(percent: pd.DataFrame, scenes: Sequence[str]) -> list[str]:
    """Format the success rate and SPL of each scene; empty where there is none."""
    return [
        _cell(*row) for row in percent.reindex(list(scenes))[["sr", "spl"]].to_numpy(np.float64)
    ]


def _dynamic(run: pd.DataFrame, scenes: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Return the heading and values of the metrics of episodes that change, over all sounds."""
    pooled = run[run["sound"] == ALL_SOUNDS]
    means = (pooled if len(pooled) else run).groupby("scene", sort=False).mean(numeric_only=True)
    found = []
    for metric, (heading, factor) in DYNAMIC_HEADINGS.items():
        if metric in means and means[metric].notna().any():
            values = factor * means[metric].reindex(list(scenes))
            found.append((heading, ["" if np.isnan(own) else f"{own:.1f}" for own in values]))
    return found


def _cell(sr: float, spl: float) -> str:
    if np.isnan(sr):
        return ""
    return "/".join("100" if value >= 99.95 else f"{value:.1f}" for value in (sr, spl))


def readable(scene: str) -> str:
    """Format the name of a scene, such as `Room 1`."""
    return scene.replace("_", " ").capitalize()
