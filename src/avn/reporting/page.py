"""Report page: results, episodes and their media in one HTML file."""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass
from importlib import resources
from itertools import permutations
from typing import Any

import jinja2
import pandas as pd

from avn.core.errors import UserError
from avn.reporting.breakdown import breakdown_figure
from avn.reporting.comparison import INDEPENDENT, compare
from avn.reporting.comparison_table import line, mcnemar_line
from avn.reporting.page_media import figure_url
from avn.reporting.paper import PAPER, paper_results
from avn.reporting.results import ALL_SOUNDS, AVERAGE, INTERVAL, NO_INTERVAL
from avn.reporting.trajectory_figures import RUN_COLOURS

_TEMPLATES = "avn.reporting"
_ENDS = ("low", "high")
# Identity of an episode in all runs that have it.
_SAME = ("scene", "sound", "seed", "episode", "source_cell", "start_cell", "start_heading")


@dataclass(frozen=True)
class PageRun:
    """Run on the report page.

    Attributes
    ----------
    name, folder, settings : str
        Label, location and settings in words.
    privileged : bool
        True if the agent uses ground truth that is not observable.
    results, episodes : DataFrame
        `results.csv` and `episodes.csv`; of a group of runs that differ only in their seed, the
        results are those of `avn.reporting.results.across_runs`.
    media : dict of int to int
        Index of the embedded episode by row of `episodes.csv`.
    paths : list of dict, optional
        Index of the `plan` and `states` of the path of each episode.
    within : bool
        True if the run is a member of a group of runs that differ only in their seed.
    world : str
        World of the run in words; see `avn.pipeline.benchmark.describe_world`.
    paper : collection of str
        Sounds beside whose results those of the paper stand.
    """

    name: str
    folder: str
    settings: str
    privileged: bool
    results: pd.DataFrame
    episodes: pd.DataFrame
    media: dict[int, int]
    paths: list[dict[str, Any]] | None = None
    within: bool = False
    world: str = ""
    paper: Collection[str] = ()


def render(
    title: str,
    runs: Sequence[PageRun],
    plans: Sequence[dict[str, Any]],
    views: Sequence[str],
    episodes: Sequence[dict[str, Any]],
    note: str = "",
) -> str:
    """Render the page as self-contained HTML.

    Parameters
    ----------
    title : str
    runs : sequence of PageRun
    plans : sequence of dict
        Floor plans; see `page_media.scene_plan`.
    views : sequence of str
        Data URLs of views; see `page_media.view_url`.
    episodes : sequence of dict
        Embedded episodes, which refer to plans and views by index; see
        `page_media.episode_media`.
    note : str
        Warning about the results, such as `avn.reporting.world.TRIAL_NOTE`.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    named = dict.fromkeys(scene for run in runs for scene in run.results["scene"])
    apartments = [scene for scene in named if scene != AVERAGE]
    scenes = [*apartments, AVERAGE] if len(apartments) > 1 else apartments
    rows = [row for index, run in enumerate(runs) for row in _rows(index, run, scenes)]
    data = {
        "average": AVERAGE,
        "all": ALL_SOUNDS,
        "plans": list(plans),
        "runs": [
            {
                "name": run.name,
                "colour": _colour(index),
                "episodes": _episodes(run),
                "paths": run.paths is not None,
            }
            for index, run in enumerate(runs)
        ],
        "comparisons": _comparisons(runs),
    }
    return environment.get_template("report.html.j2").render(
        title=title,
        note=note,
        worlds=list(dict.fromkeys(run.world for run in runs if run.world)),
        interval=INTERVAL,
        no_interval=NO_INTERVAL,
        independent=INDEPENDENT,
        intervals_missing=any(
            cell and cell["sr_low"] is None for row in rows for cell in row["cells"]
        ),
        paper=PAPER,
        has_paper=any(cell and cell["paper"] for row in rows for cell in row["cells"]),
        scenes=scenes,
        rows=rows,
        runs=runs,
        data=data,
        views=list(views),
        episodes=list(episodes),
        breakdown=_breakdown(runs, note),
        shown_runs=[run.name for run in runs if not run.within],
        any_paths=any(run.paths for run in runs),
        base=next(run.name for run in runs if not run.within),
        differences=_differences(runs),
        licence="sortable-tablesort by Jonas Earendel, public domain (Unlicense)",
        # trusted files of the package, which must not be escaped
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


def _rows(index: int, run: PageRun, scenes: Sequence[str]) -> list[dict[str, Any]]:
    """Return the rows of a run in the table of results, one per sound."""
    rows = []
    for sound, part in run.results.groupby("sound", sort=False):
        own = {str(row["scene"]): row for row in part.to_dict("records")}
        paper = _paper(str(part["agent"].iloc[0]), str(sound), run.paper)
        cells = [_cell(own[scene], paper.get(scene)) if scene in own else None for scene in scenes]
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


def _cell(row: dict[Hashable, Any], paper: tuple[float, float] | None) -> dict[str, Any]:
    """Return a cell of the table in %, in full precision; missing intervals are None."""
    scene = str(row["scene"])
    cell: dict[str, Any] = {"scene": scene, "paper": paper, "spread": _spread(row)}
    for metric in ("sr", "spl"):
        cell[metric] = 100 * row[metric]
        for end in _ENDS:
            value = 100 * row[f"{metric}_{end}"]
            cell[f"{metric}_{end}"] = None if math.isnan(value) else value
    return cell


def _spread(row: dict[Hashable, Any]) -> tuple[float, float] | None:
    """Return the standard deviation of success rate and SPL over seeds in percentage points."""
    spread = [100 * row.get(f"{metric}_std", math.nan) for metric in ("sr", "spl")]
    return None if math.isnan(spread[0]) else (spread[0], spread[1])


def _comparisons(runs: Sequence[PageRun]) -> dict[str, str]:
    """Compare each run as A with each other one as B, in words, by their indices."""
    lines = {}
    for (i, one), (j, other) in permutations(enumerate(runs), 2):
        try:
            found = compare(one.episodes, other.episodes, (one.name, other.name))
            lines[f"{i}-{j}"] = line(found, "A", "B")
        except UserError as error:
            lines[f"{i}-{j}"] = f"Not compared: {error}"
    return lines


def _differences(runs: Sequence[PageRun]) -> list[dict[str, Any]]:
    """Compare each run with the first over the same episodes; a reason where it is not possible."""
    rows: list[dict[str, Any]] = []
    first, *others = (run for run in runs if not run.within)
    for run in others:
        try:
            found = compare(run.episodes, first.episodes, (run.name, first.name))
        except UserError as error:
            rows.append({"name": run.name, "reason": str(error)})
            continue
        table = 100 * found.table.set_index("metric").loc[["sr", "spl"]]
        columns = table[["difference", "low", "high", "detectable"]].to_numpy().tolist()
        sr, spl = ([None if math.isnan(v) else v for v in values] for values in columns)
        test = "" if found.mcnemar is None else mcnemar_line(found, run.name, first.name)
        rows.append({"name": run.name, "sr": sr, "spl": spl, "test": test, "reason": ""})
    return rows


def _breakdown(runs: Sequence[PageRun], note: str) -> str:
    """Draw the results by difficulty as a data URL, in the colours of the runs."""
    own = {run.name: index for index, run in enumerate(runs) if not run.within}
    episodes = {name: runs[index].episodes for name, index in own.items()}
    return figure_url(breakdown_figure(episodes, [_colour(index) for index in own.values()], note))


def _paper(agent: str, sound: str, sounds: Collection[str]) -> dict[str, tuple[float, float]]:
    """Return the paper's success rate and SPL in % of an agent and sound by scene."""
    rows = paper_results({agent: sounds})
    own = rows[rows["sound"] == sound].to_dict("records")
    return {str(row["scene"]): (float(row["sr"]), float(row["spl"])) for row in own}


def _episodes(run: PageRun) -> list[list[Any]]:
    """Return a run's episodes as rows for `report.js`."""
    return [
        [
            str(row["scene"]),
            str(row["sound"]),
            int(row["episode"]),
            float(row["geodesic"]),
            int(row["in_sight"]),
            int(row["rooms_crossed"]),
            str(row["outcome"]),
            float(row["spl"]),
            int(row["actions"]),
            run.media.get(int(label)),
            place,
            int(row.get("source_end_cell", row["source_cell"])),
            int(row["success"]),
            ":".join(str(row[key]) for key in _SAME),
        ]
        for place, (label, row) in enumerate(
            zip(run.episodes.index, run.episodes.to_dict("records"), strict=True)
        )
    ]
