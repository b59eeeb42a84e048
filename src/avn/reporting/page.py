"""The report page: tables, episodes and their media put into one HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

import jinja2
import pandas as pd

from avn.core.errors import UserError
from avn.reporting.breakdown import breakdown_figure
from avn.reporting.page_media import figure_url
from avn.reporting.results import ALL_SOUNDS, AVERAGE, compare
from avn.reporting.table import PAPER, PAPER_PROTOCOL, paper_table
from avn.reporting.trajectory_figures import RUN_COLOURS

_TEMPLATES = "avn.reporting"
_ENDS = ("low", "high")


@dataclass(frozen=True)
class PageRun:
    """A run as the page shows it.

    Attributes
    ----------
    name, folder, settings : str
        What it is called, where it lies, how it was set, in words.
    privileged : bool
    results, episodes : DataFrame
        `results.csv` and `episodes.csv`.
    media : dict of int to int
        By row of `episodes.csv`, the number of its embedded episode.
    ways : list of dict, optional
        Of each episode the number of its `plan` and the `states` of its way.
    seeds : DataFrame, optional
        Of several runs that differ in their seed alone: `results.across_seeds` of them.
    within : bool
        Whether it is one of such runs.
    """

    name: str
    folder: str
    settings: str
    privileged: bool
    results: pd.DataFrame
    episodes: pd.DataFrame
    media: dict[int, int]
    ways: list[dict[str, Any]] | None = None
    seeds: pd.DataFrame | None = None
    within: bool = False


def render(
    title: str,
    runs: Sequence[PageRun],
    plans: Sequence[dict[str, Any]],
    views: Sequence[str],
    episodes: Sequence[dict[str, Any]],
) -> str:
    """The page as HTML, which asks for nothing from anywhere.

    Parameters
    ----------
    title : str
    runs : sequence of PageRun
    plans, views, episodes : sequences
        What the embedded episodes point at by number; see `avn.reporting.page_media`.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    named = dict.fromkeys(room for run in runs for room in run.results["scene"])
    rooms = [*(room for room in named if room != AVERAGE), AVERAGE]
    rows = [row for index, run in enumerate(runs) for row in _rows(index, run, rooms)]
    data = {
        "average": AVERAGE,
        "all": ALL_SOUNDS,
        "plans": list(plans),
        "runs": [
            {
                "name": run.name,
                "colour": _colour(index),
                "episodes": _episodes(run),
                "ways": run.ways is not None,
            }
            for index, run in enumerate(runs)
        ],
    }
    return environment.get_template("report.html.j2").render(
        title=title,
        paper=PAPER,
        has_paper=any(cell and cell["paper"] for row in rows for cell in row["cells"]),
        rooms=rooms,
        rows=rows,
        runs=runs,
        data=data,
        views=list(views),
        episodes=list(episodes),
        breakdown=_breakdown(runs),
        any_ways=any(run.ways for run in runs),
        base=next(run.name for run in runs if not run.within),
        differences=_differences(runs),
        licence="sortable-tablesort by Jonas Earendel, public domain (Unlicense)",
        # our own files, which must not be escaped within their elements
        **{
            name: jinja2.utils.markupsafe.Markup(_text(file))
            for name, file in (
                ("css", "report.css"),
                ("script", "report.js"),
                ("sortable", "sortable.min.js"),
            )
        },
    )


def _text(name: str) -> str:
    return (resources.files(_TEMPLATES) / "templates" / name).read_text(encoding="utf-8")


def _colour(index: int) -> str:
    return RUN_COLOURS[index % len(RUN_COLOURS)]


def _rows(index: int, run: PageRun, rooms: Sequence[str]) -> list[dict[str, Any]]:
    """The table's rows of a run, one for each sound."""
    paper = _paper()
    rows = []
    for sound, part in run.results.groupby("sound", sort=False):
        own = {str(row["scene"]): row for row in part.to_dict("records")}
        cells: list[dict[str, Any] | None] = []
        for room in rooms:
            if room not in own:
                cells.append(None)
                continue
            found, key = own[room], (str(own[room]["agent"]), str(own[room]["protocol"]))
            cell: dict[str, Any] = {"scene": room, "paper": paper.get((*key, str(sound), room))}
            for figure in ("sr", "spl"):
                cell[figure] = round(100 * found[figure], 2)
                for end in _ENDS:
                    cell[f"{figure}_{end}"] = 100 * found[f"{figure}_{end}"]
            cell["spread"] = _spread(run, str(sound), room)
            cells.append(cell)
        rows.append(
            {
                "run": index,
                "name": run.name,
                "colour": _colour(index),
                "privileged": run.privileged,
                "sound": str(sound),
                "cells": cells,
            }
        )
    return rows


def _spread(run: PageRun, sound: str, room: str) -> tuple[float, float] | None:
    """Standard deviation of success rate and SPL over the seeds, in points."""
    if run.seeds is None:
        return None
    chosen = (run.seeds["sound"] == sound) & (run.seeds["scene"] == room)
    row = run.seeds[chosen].iloc[0]
    return 100 * float(row["sr_std"]), 100 * float(row["spl_std"])


def _differences(runs: Sequence[PageRun]) -> list[dict[str, Any]]:
    """How much better each run is than the first, where both walked the same episodes."""
    rows = []
    first, *others = (run for run in runs if not run.within)
    for run in others:
        try:
            table = compare(run.episodes, first.episodes).set_index("figure")
        except UserError:
            continue
        points = 100 * table.loc[["sr", "spl"], ["difference", "low", "high"]].to_numpy()
        rows.append({"name": run.name, "sr": points[0].tolist(), "spl": points[1].tolist()})
    return rows


def _breakdown(runs: Sequence[PageRun]) -> str:
    """The figure of results by difficulty, in the colours of the runs."""
    own = {run.name: index for index, run in enumerate(runs) if not run.within}
    episodes = {name: runs[index].episodes for name, index in own.items()}
    return figure_url(breakdown_figure(episodes, [_colour(index) for index in own.values()]))


def _paper() -> dict[tuple[str, ...], tuple[float, float]]:
    """The paper's success rate and SPL by agent, protocol, sound and room."""
    table = paper_table()
    means = table.groupby(["agent", "scene"], as_index=False)[["sr", "spl"]].mean()
    table = pd.concat([table, means.assign(sound=ALL_SOUNDS)])
    return {
        (row["agent"], PAPER_PROTOCOL, row["sound"], row["scene"]): (row["sr"], row["spl"])
        for row in table.to_dict("records")
    }


def _episodes(run: PageRun) -> list[list[Any]]:
    """A run's episodes as the script lists them."""
    return [
        [
            str(row["scene"]),
            str(row["sound"]),
            int(row["episode"]),
            float(row["geodesic"]),
            int(row["in_sight"]),
            int(row["rooms_crossed"]),
            str(row["outcome"]),
            round(float(row["spl"]), 3),
            int(row["actions"]),
            run.media.get(int(label)),
            place,
            int(row["source_cell"]),
        ]
        for place, (label, row) in enumerate(
            zip(run.episodes.index, run.episodes.to_dict("records"), strict=True)
        )
    ]
