"""Records of episodes, metrics by scene and sound, and their CSV files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.reporting.bootstrap import DRAWS, MIN_GROUPS, estimate
from avn.reporting.nesting import NETWORK, nested

LABELS = ("agent", "protocol", "acoustics", "look")
# Value of `look` of every agent that does not rotate to observe, not named in headings.
USUAL_LOOK = "once"
EPISODE_COLUMNS = (
    *LABELS,
    *("sound", "scene", "seed", "episode", "start_cell", "start_heading", "source", "source_cell"),
    *("in_sight", "rooms_crossed", "geodesic", "euclidean", "end_cell", "path_length", "shortest"),
    *("actions", "fewest_actions", "fewest_actions_to_source", "collisions", "outcome"),
    *("success", "spl", "softspl", "sna", "dtg", "sna_goal"),
)
# Metrics of results.csv, and the column of episodes.csv that each is the mean of. Rates are from 0
# to 1; dtg is in metres.
METRICS = {"sr": "success"} | {name: name for name in ("spl", "softspl", "sna", "dtg", "sna_goal")}
INTERVALS = tuple(f"{metric}_{end}" for metric in METRICS for end in ("low", "high"))
RESULT_COLUMNS = (*LABELS, "sound", "scene", "seed", "episodes", *METRICS, *INTERVALS)
# Metrics of worlds that change in the course of an episode, and their columns of episodes.csv:
# success after the sound has ended, Stop at the distractor (rates), the error of the odometry at
# the end in metres, and dynamic SPL and the normalised distance to the goal of a moving source.
DYNAMIC_METRICS = {
    "sws": "success_when_silent",
    "dsr": "stopped_at_distractor",
    "drift": "drift",
    "dspl": "dspl",
    "ndtg": "ndtg",
}
# Their headings in tables, and factors.
DYNAMIC_HEADINGS = {
    "sws": ("SWS, %", 100.0),
    "dsr": ("DSR, %", 100.0),
    "drift": ("drift, m", 1.0),
    "dspl": ("DSPL, %", 100.0),
    "ndtg": ("NDTG, %", 100.0),
}
ALL_SOUNDS = "all"
AVERAGE = "average"
NO_INTERVAL = (
    f"too few apartments, or of one apartment too few sources (fewer than {MIN_GROUPS}), for an "
    "interval"
)
# Meaning of the intervals of a table.
ONE_INTERVAL = "of one apartment alone, sources and episodes, of this apartment only"
INTERVAL = f"95 %, apartments, sources and episodes resampled; {ONE_INTERVAL}"
NETWORK_INTERVAL = f"95 %, networks, apartments, sources and episodes resampled; {ONE_INTERVAL}"


def summarise(episodes: pd.DataFrame, draws: int = DRAWS) -> pd.DataFrame:
    """Compute the metrics by scene and sound, with confidence intervals.

    Parameters
    ----------
    episodes : DataFrame
        Records of any number of agents, protocols, sounds, scenes and seeds; see
        `avn.agents.rollout.rollout_scene`.
    draws : int
        Bootstrap resamples; 0 for no intervals.

    Returns
    -------
    DataFrame
        Columns `RESULT_COLUMNS`, and those of the `DYNAMIC_METRICS` of the records. Scene
        `average` is the unweighted mean over scenes, as in the paper. Sound `all` pools the
        episodes of all sounds if there are several. Intervals are 95 % intervals of
        `avn.reporting.bootstrap`, NaN where there are too few apartments: those of `average` are
        for new apartments, those of a scene for new sources in it.

    Raises
    ------
    UserError
        If there is no episode.
    """
    if not len(episodes):
        raise UserError("split: no episode was walked; choose a split with a test apartment")
    rows = []
    for keys, run in episodes.groupby([*LABELS, "seed"], sort=False):
        labels = dict(zip((*LABELS, "seed"), keys, strict=True))
        for cell, part in _cells(run):
            rows.append(labels | cell | {"episodes": len(part)} | _metrics(part, draws))
    others = [name for name in rows[0] if name not in RESULT_COLUMNS]
    return pd.DataFrame(rows, columns=[*RESULT_COLUMNS, *others])


def metrics_of(episodes: pd.DataFrame) -> dict[str, str]:
    """Return the metrics of records, each with the column that it is the mean of."""
    others = DYNAMIC_METRICS.items()
    return METRICS | {name: column for name, column in others if column in episodes}


def _cells(run: pd.DataFrame) -> Iterator[tuple[dict[str, str], pd.DataFrame]]:
    """Yield sound, scene and episodes of each row, with all sounds and the average last."""
    sounds = [(str(sound), part) for sound, part in run.groupby("sound", sort=False)]
    if len(sounds) > 1:
        sounds.append((ALL_SOUNDS, run))
    for sound, part in sounds:
        scenes = [(str(scene), own) for scene, own in part.groupby("scene", sort=False)]
        for scene, own in [*scenes, (AVERAGE, part)]:
            yield {"sound": sound, "scene": scene}, own


def _metrics(episodes: pd.DataFrame, draws: int) -> dict[str, float]:
    metrics = metrics_of(episodes)
    found = estimate(nested(episodes, [*metrics.values()]), draws=draws)
    ends = np.stack((found.low, found.high), axis=1)
    values = dict(zip(metrics, found.mean.tolist(), strict=True))
    for metric, (low, high) in zip(metrics, ends.tolist(), strict=True):
        values |= {f"{metric}_low": low, f"{metric}_high": high}
    return values


def headline(results: pd.DataFrame) -> dict[str, float]:
    """Return the metrics of one run over all scenes and sounds.

    Raises
    ------
    ValueError
        If the results are of more than one agent, protocol or seed.
    """
    average = results[results["scene"] == AVERAGE]
    if len(average) > 1:
        average = average[average["sound"] == ALL_SOUNDS]
    if len(average) != 1:
        raise ValueError(f"results of one run have one average, these have {len(average)}")
    return {metric: float(average.iloc[0][metric]) for metric in METRICS}


def across_runs(episodes: pd.DataFrame, draws: int = DRAWS) -> pd.DataFrame:
    """Compute the metrics of each setting over all seeds and networks.

    Parameters
    ----------
    episodes : DataFrame
        Records of any number of runs. Those of several networks have a column `train_seed`, and
        each network the same episodes.
    draws : int
        Bootstrap resamples; 0 for no intervals.

    Returns
    -------
    DataFrame
        One row per agent, protocol, acoustics, look, sound and scene: `seeds`, `networks` and
        `episodes`, their numbers; each metric and its interval, as those of `summarise`, with the
        networks resampled too if there are several; `<metric>_std`, the standard deviation between
        seeds, and `<metric>_network_std`, that between networks, NaN for a single one.

    Raises
    ------
    UserError
        If the networks have different episodes.
    """
    rows = []
    for keys, run in episodes.groupby(list(LABELS), sort=False):
        labels = dict(zip(LABELS, keys, strict=True))
        for cell, part in _cells(run):
            row = labels | cell | {"seeds": part["seed"].nunique(), "networks": 1}
            row |= {"episodes": len(part)} | _metrics(part, draws) | _spread(part, "seed", "std")
            row |= _spread(part, NETWORK, "network_std")
            if NETWORK in part:
                row["networks"] = part[NETWORK].nunique()
            rows.append(row)
    return pd.DataFrame(rows)


def _spread(episodes: pd.DataFrame, key: str, name: str) -> dict[str, float]:
    """Compute the standard deviations of the metrics between the values of a column."""
    metrics = metrics_of(episodes)
    columns = list(metrics.values())
    if key not in episodes:
        return {f"{metric}_{name}": np.nan for metric in metrics}
    means = episodes.groupby([key, "scene"])[columns].mean().groupby(key).mean()
    spread = means.std(ddof=1).tolist()
    return {f"{metric}_{name}": own for metric, own in zip(metrics, spread, strict=True)}


def shown_scenes(results: pd.DataFrame) -> list[str]:
    """Return the scenes of a table in order; without the average where there is a single scene."""
    scenes = list(dict.fromkeys(results["scene"].astype(str)))
    return [scene for scene in scenes if scene != AVERAGE] if len(scenes) == 2 else scenes


def write_csv(table: pd.DataFrame, path: Path) -> None:
    """Write a table as CSV, atomically."""
    with atomic_write(path) as part:
        table.to_csv(part, index=False, lineterminator="\n")


def read_csv(path: Path) -> pd.DataFrame:
    """Read a table of this module; names are kept as text, also a sound called 440 or nan."""
    names = dict.fromkeys((*LABELS, "sound", "scene", "outcome"), str)
    return pd.read_csv(path, dtype=names, keep_default_na=False, na_values=[""])
