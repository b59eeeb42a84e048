"""Terminal tables of results by scene and sound in the layout of the paper."""

from __future__ import annotations

from collections.abc import Collection
from importlib import resources

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from avn.reporting.results import ALL_SOUNDS, AVERAGE

PAPER = "Gan et al. 2020"
PAPER_PROTOCOL = "var"


def paper_table() -> pd.DataFrame:
    """Read the results of the paper in long form: agent, sound, scene, sr, spl, both in %.

    Gan, Zhang, Wu, Gong and Tenenbaum, "Look, Listen, and Act: Towards Audio-Visual Embodied
    Navigation", ICRA 2020, table I. Its scenes are other apartments of the same size.
    """
    file = resources.files("avn") / "assets" / "paper_table.csv"
    with file.open(encoding="utf-8") as lines:
        return pd.read_csv(lines)


def results_table(results: pd.DataFrame, privileged: Collection[str] = ()) -> Table:
    """Tabulate success rate / SPL in %, with rows of agents and sounds and columns of scenes.

    Results of several seeds are averaged. Rows of protocol `var` are followed by those of the
    paper if it has them; its `all` is the mean over its sounds. Agents in `privileged` are marked
    as upper bounds.
    """
    scenes = list(dict.fromkeys(results["scene"]))
    table = Table(title="success rate / SPL, %", box=None, pad_edge=False, title_justify="left")
    table.add_column("", no_wrap=True)
    for scene in scenes:
        table.add_column(readable(scene), justify="right", no_wrap=True)
    paper = _paper_cells()
    columns = ["agent", "protocol", "acoustics", "look"]
    for keys, run in results.groupby(columns, sort=False):
        names = [str(key) for key in keys]
        mark = " (privileged: upper bound)" if names[0] in privileged else ""
        table.add_row(f"[bold]{' · '.join(names)}{mark}[/bold]")
        for sound, part in run.groupby("sound", sort=False):
            means = 100.0 * part.groupby("scene", sort=False)[["sr", "spl"]].mean()
            cells = [_cell(*row) for row in means.reindex(scenes).to_numpy()]
            table.add_row(f"  {sound}", *cells)
            own = [paper.get((*names[:2], str(sound), scene), "") for scene in scenes]
            if any(own):
                table.add_row(f"    {PAPER}", *own, style="dim")
    return table


def hardness(episodes: pd.DataFrame) -> pd.DataFrame:
    """Compute the difficulty of the starts by scene and on average.

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
    privileged : collection of str
        Agents that are marked as upper bounds.
    """
    console = console or wide_console()
    for table in (results_table(results, privileged), hardness_table(episodes)):
        console.print(table)
        console.print()


def wide_console() -> Console:
    """Create a console that is 120 characters wide if the output is a file or a pipe."""
    console = Console()
    return console if console.is_terminal else Console(width=120)


def _paper_cells() -> dict[tuple[str, ...], str]:
    """Format the paper's results by agent, protocol, sound and scene."""
    table = paper_table()
    means = table.groupby(["agent", "scene"], as_index=False)[["sr", "spl"]].mean()
    table = pd.concat([table, means.assign(sound=ALL_SOUNDS)])
    keys = zip(table["agent"], table["sound"], table["scene"], strict=True)
    metrics = table[["sr", "spl"]].to_numpy()
    return {
        (agent, PAPER_PROTOCOL, sound, scene): _cell(*row)
        for (agent, sound, scene), row in zip(keys, metrics, strict=True)
    }


def _cell(sr: float, spl: float) -> str:
    if np.isnan(sr):
        return ""
    return "/".join("100" if value >= 99.95 else f"{value:.1f}" for value in (sr, spl))


def readable(scene: str) -> str:
    """Format the name of a scene, such as `Room 1`."""
    return scene.replace("_", " ").capitalize()
