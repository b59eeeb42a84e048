"""Files of a finished run: reading its records, and printing its tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from avn.core.errors import UserError
from avn.reporting import perception_tables, results, table

RESULTS, EPISODE_RECORDS = "results.csv", "episodes.csv"
SOURCE_ESTIMATES, ARRIVALS, LOCAL_PATCHES, LOCALISATION = (
    "source_estimates.csv",
    "arrivals.csv",
    "local_patches.csv",
    "localisation.csv",
)
_PERCEPTION = {
    SOURCE_ESTIMATES: perception_tables.source_estimates_table,
    ARRIVALS: perception_tables.arrivals_table,
    LOCAL_PATCHES: perception_tables.local_patches_table,
    LOCALISATION: perception_tables.localisation_table,
}


def read_run(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Read results and episodes of a finished run; see `read_episodes`."""
    episodes = read_episodes(folder)
    # the rule for intervals may have changed since the run
    return results.summarise(episodes), episodes


def read_episodes(folder: Path) -> pd.DataFrame:
    """Read the episodes of a finished run.

    Raises
    ------
    UserError
        Where a file is missing or damaged, the results do not match the episodes, or an earlier
        version wrote them with other columns.
    """
    damaged = UserError(f"{folder}: the run is damaged; delete the folder and run again")
    try:
        runs, episodes = (results.read_csv(folder / name) for name in (RESULTS, EPISODE_RECORDS))
    except (OSError, ValueError) as error:
        raise damaged from error
    lacking = [name for name in results.EPISODE_COLUMNS if name not in episodes]
    if lacking and set(results.LABELS) <= set(episodes):
        raise UserError(
            f"{folder}: an earlier version of avn made the run, {EPISODE_RECORDS} has no "
            f"{', '.join(lacking)}; delete the folder and run again"
        )
    metrics = results.metrics_of(episodes)
    ends = [f"{metric}_{end}" for metric in metrics for end in ("low", "high")]
    try:
        if episodes[list(metrics.values())].isna().any(axis=None):
            raise ValueError("a metric is missing")
        summary = results.summarise(episodes, draws=0)
        pd.testing.assert_frame_equal(runs.drop(columns=ends), summary.drop(columns=ends))
    except (ValueError, KeyError, TypeError, AssertionError, UserError) as error:
        raise damaged from error
    return episodes


def show_run(folder: Path, caption: str, privileged: bool, paper: Sequence[str] = ()) -> None:
    """Print the results of a run by scene and sound, by difficulty, and of its perception.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    caption : str
        World of the run, for the caption of each table.
    privileged : bool
        Whether its agent has access to ground truth.
    paper : sequence of str
        Sounds beside whose results those of the paper may stand.
    """
    runs, episodes = read_run(folder)
    labels = list(dict.fromkeys(runs["agent"]))
    table.print_tables(
        runs,
        episodes,
        privileged=labels if privileged else [],
        paper={label: frozenset(paper) for label in labels},
        caption=caption,
    )
    for name, tabulate in _PERCEPTION.items():
        if (folder / name).is_file():
            table.print_table(tabulate(results.read_csv(folder / name)), caption)
