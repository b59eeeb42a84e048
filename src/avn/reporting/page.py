"""Report page: results, episodes and their media in one HTML file."""

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
    """Run on the report page.

    Attributes
    ----------
    name, folder, settings : str
        Label, location and settings in words.
    privileged : bool
        True if the agent uses ground truth that is not observable.
    results, episodes : DataFrame
        `results.csv` and `episodes.csv`.
    media : dict of int to int
        Index of the embedded episode by row of `episodes.csv`.
    paths : list of dict, optional
        Index of the `plan` and `states` of the path of each episode.
    seeds : DataFrame, optional
        For a group of runs that differ only in their seed: its `results.across_seeds`.
    within : bool
        True if the run is a member of such a group.
    """

    name: str
    folder: str
    settings: str
    privileged: bool
    results: pd.DataFrame
    episodes: pd.DataFrame
    media: dict[int, int]
    paths: list[dict[str, Any]] | None = None
    seeds: pd.DataFrame | None = None
    within: bool = False


def render(
    title: str,
    runs: Sequence[PageRun],
    plans: Sequence[dict[str, Any]],
    views: Sequence[str],
    episodes: Sequence[dict[str, Any]],
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
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    named = dict.fromkeys(scene for run in runs for scene in run.results["scene"])
    scenes = [*(scene for scene in named if scene != AVERAGE), AVERAGE]
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
    }
    return environment.get_template("report.html.j2").render(
        title=title,
        paper=PAPER,
        has_paper=any(cell and cell["paper"] for row in rows for cell in row["cells"]),
        scenes=scenes,
        rows=rows,
        runs=runs,
        data=data,
        views=list(views),
        episodes=list(episodes),
        breakdown=_breakdown(runs),
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
    paper = _paper()
    rows = []
    for sound, part in run.results.groupby("sound", sort=False):
        own = {str(row["scene"]): row for row in part.to_dict("records")}
        cells: list[dict[str, Any] | None] = []
        for scene in scenes:
            if scene not in own:
                cells.append(None)
                continue
            found, key = own[scene], (str(own[scene]["agent"]), str(own[scene]["protocol"]))
            cell: dict[str, Any] = {"scene": scene, "paper": paper.get((*key, str(sound), scene))}
            for metric in ("sr", "spl"):
                cell[metric] = round(100 * found[metric], 2)
                for end in _ENDS:
                    cell[f"{metric}_{end}"] = 100 * found[f"{metric}_{end}"]
            cell["spread"] = _spread(run, str(sound), scene)
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


def _spread(run: PageRun, sound: str, scene: str) -> tuple[float, float] | None:
    """Return the standard deviation of success rate and SPL over seeds in percentage points."""
    if run.seeds is None:
        return None
    chosen = (run.seeds["sound"] == sound) & (run.seeds["scene"] == scene)
    row = run.seeds[chosen].iloc[0]
    return 100 * float(row["sr_std"]), 100 * float(row["spl_std"])


def _differences(runs: Sequence[PageRun]) -> list[dict[str, Any]]:
    """Compute paired differences of each run to the first, if both have the same episodes."""
    rows = []
    first, *others = (run for run in runs if not run.within)
    for run in others:
        try:
            table = compare(run.episodes, first.episodes).set_index("metric")
        except UserError:
            continue
        points = 100 * table.loc[["sr", "spl"], ["difference", "low", "high"]].to_numpy()
        rows.append({"name": run.name, "sr": points[0].tolist(), "spl": points[1].tolist()})
    return rows


def _breakdown(runs: Sequence[PageRun]) -> str:
    """Draw the results by difficulty as a data URL, in the colours of the runs."""
    own = {run.name: index for index, run in enumerate(runs) if not run.within}
    episodes = {name: runs[index].episodes for name, index in own.items()}
    return figure_url(breakdown_figure(episodes, [_colour(index) for index in own.values()]))


def _paper() -> dict[tuple[str, ...], tuple[float, float]]:
    """Return the paper's success rate and SPL in % by agent, protocol, sound and scene."""
    table = paper_table()
    means = table.groupby(["agent", "scene"], as_index=False)[["sr", "spl"]].mean()
    table = pd.concat([table, means.assign(sound=ALL_SOUNDS)])
    return {
        (row["agent"], PAPER_PROTOCOL, row["sound"], row["scene"]): (row["sr"], row["spl"])
        for row in table.to_dict("records")
    }


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
