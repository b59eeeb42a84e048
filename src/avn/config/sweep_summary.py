"""Summary of a sweep: means over seeds and networks of each setting, and their differences."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from avn.core.errors import UserError
from avn.core.files import stage_folder
from avn.core.hashing import digest
from avn.core.progress import log
from avn.reporting.comparison import INDEPENDENT, compare
from avn.reporting.comparison_table import line
from avn.reporting.finished_run import EPISODE_RECORDS
from avn.reporting.nesting import NETWORK
from avn.reporting.results import (
    AVERAGE,
    INTERVAL,
    NETWORK_INTERVAL,
    NO_INTERVAL,
    across_runs,
    read_csv,
    write_csv,
)


def summarise(records: Iterable[Mapping[str, Any]], tell_folder: bool) -> None:
    """Print the summary of a sweep and write it as `results.csv`.

    Parameters
    ----------
    records : iterable of mapping
        Record of each job: its `setting` and `train_seed`, and `folder` and `outputs` of its
        results, or None.
    tell_folder : bool
        Whether the folder of the summary is printed.
    """
    # seed=0,0 are two jobs and one run
    runs = {(record["setting"], record["folder"]): record for record in records if record["folder"]}
    finished = list(runs.values())
    episodes = _episodes(finished)
    if not episodes:
        return
    tables = [across_runs(own).assign(setting=key) for key, own in episodes.items()]
    summary = pd.concat(tables, ignore_index=True)
    _print(summary)
    _compare(episodes)
    for note in dict.fromkeys(record["note"] for record in finished if record["note"]):
        log(note)
    outputs = Path(finished[0]["outputs"])
    done = [Path(record["folder"]).relative_to(outputs).as_posix() for record in finished]
    path = stage_folder(outputs, "eval", "sweeps/sweep", digest(done)) / "results.csv"
    write_csv(summary, path)
    if tell_folder:
        log(str(path.parent))


def _episodes(finished: Iterable[Mapping[str, Any]]) -> dict[str, pd.DataFrame]:
    """Return the episodes of all seeds and networks by setting.

    Where jobs failed, so that networks have other seeds, each network is a setting of its own.
    """
    runs: dict[str, list[pd.DataFrame]] = {}
    for record in finished:
        path = Path(record["folder"]) / EPISODE_RECORDS
        if path.is_file():
            own = read_csv(path).assign(**{NETWORK: record["train_seed"]})
            runs.setdefault(record["setting"], []).append(own)
    found: dict[str, pd.DataFrame] = {}
    for setting, parts in runs.items():
        episodes = pd.concat(parts, ignore_index=True)
        seeds = episodes.groupby(NETWORK)["seed"].agg(lambda own: str(sorted(set(own))))
        if seeds.nunique() == 1:
            found[setting] = episodes
            continue
        for network, own in episodes.groupby(NETWORK):
            found[", ".join(filter(None, (setting, f"{NETWORK}={network}")))] = own
    return found


def _print(summary: pd.DataFrame) -> None:
    average = summary[summary["scene"] == AVERAGE]
    for row in average.to_dict("records"):
        metrics = ", ".join(_metric(row, metric) for metric in ("sr", "spl"))
        labels = f"{row['agent']}, {row['sound']} ({row['setting'] or 'defaults'})"
        labels += f", {row['protocol']}, {row['acoustics']}"
        counts = "1 seed" if row["seeds"] == 1 else f"{row['seeds']} seeds"
        if row["networks"] > 1:
            counts += f", mean over {row['networks']} networks"
        log(f"{labels}, {counts}: {metrics}")
    known = average["sr_low"].notna()
    if known.any():
        several = (average.loc[known, "networks"] > 1).any()
        log(f"in brackets: {NETWORK_INTERVAL if several else INTERVAL}")
    if not known.all():
        log(f"without brackets: {NO_INTERVAL}")


def _metric(row: Mapping[Any, Any], metric: str) -> str:
    """Format a metric with its spread over seeds and networks and its interval."""
    text = f"{metric.upper()} {100 * row[metric]:.1f}"
    text += f" +- {100 * row[f'{metric}_std']:.1f} %" if row["seeds"] > 1 else " %"
    if row["networks"] > 1:
        text += f", sd between networks {100 * row[f'{metric}_network_std']:.1f}"
    if not math.isnan(row[f"{metric}_low"]):
        text += f" [{100 * row[f'{metric}_low']:.1f} to {100 * row[f'{metric}_high']:.1f}]"
    return text


def _compare(episodes: Mapping[str, pd.DataFrame]) -> None:
    """Print the difference of each setting to the first one, over the same episodes."""
    names = _short_names(list(episodes))
    (first, base), *others = zip(names, episodes.values(), strict=True)
    tested = False
    for setting, own in others:
        try:
            found = compare(own, base, (setting, first))
        except UserError as error:
            log(f"{setting} less {first}: not compared, {error}")
            continue
        tested = tested or found.mcnemar is not None
        log(line(found, setting, first))
    if tested:
        log(f"{INDEPENDENT}.")


def _short_names(settings: Sequence[str]) -> list[str]:
    """Return settings without the overrides that all of them have."""
    parts = [setting.split(", ") for setting in settings]
    shared = set(parts[0]).intersection(*parts)
    return [", ".join(own for own in each if own not in shared) or "defaults" for each in parts]
