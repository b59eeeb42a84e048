"""Summary of a sweep: mean and standard deviation over the seeds of each setting."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from avn.core.files import stage_folder
from avn.core.hashing import digest
from avn.core.progress import log
from avn.reporting.results import AVERAGE, across_seeds, read_csv, write_csv


def summarise(records: Iterable[Mapping[str, Any]], tell_folder: bool) -> None:
    """Print the summary of a sweep and write it as `results.csv`.

    Parameters
    ----------
    records : iterable of mapping
        Record of each job: its `setting`, and `folder` and `outputs` of its results, or None.
    tell_folder : bool
        Whether the folder of the summary is printed.
    """
    # seed=0,0 are two jobs and one run
    runs = {(record["setting"], record["folder"]): record for record in records if record["folder"]}
    finished = list(runs.values())
    summary = _spread(finished)
    if not len(summary):
        return
    _print(summary)
    for note in dict.fromkeys(record["note"] for record in finished if record["note"]):
        log(note)
    outputs = Path(finished[0]["outputs"])
    done = [Path(record["folder"]).relative_to(outputs).as_posix() for record in finished]
    path = stage_folder(outputs, "eval", "sweeps/sweep", digest(done)) / "results.csv"
    write_csv(summary, path)
    if tell_folder:
        log(str(path.parent))


def _spread(finished: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Return mean and standard deviation over seeds, for each setting of the other keys."""
    tables: dict[str, list[pd.DataFrame]] = {}
    for record in finished:
        path = Path(record["folder"]) / "results.csv"
        if path.is_file():
            tables.setdefault(record["setting"], []).append(read_csv(path))
    spreads = [across_seeds(pd.concat(runs)).assign(setting=key) for key, runs in tables.items()]
    return pd.concat(spreads, ignore_index=True) if spreads else pd.DataFrame()


def _print(summary: pd.DataFrame) -> None:
    for row in summary[summary["scene"] == AVERAGE].to_dict("records"):
        metrics = ", ".join(
            f"{metric.upper()} {100 * row[metric]:.1f}"
            + (f" +- {100 * row[metric + '_std']:.1f} %" if row["seeds"] > 1 else " %")
            for metric in ("sr", "spl")
        )
        labels = f"{row['agent']}, {row['sound']} ({row['setting'] or 'defaults'})"
        labels += f", {row['protocol']}, {row['acoustics']}"
        seeds = "1 seed" if row["seeds"] == 1 else f"{row['seeds']} seeds"
        log(f"{labels}, {seeds}: {metrics}")
