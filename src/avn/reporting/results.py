"""Records of episodes, metrics by scene and sound, and their CSV files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.navigation.metrics import MIN_CLUSTERS, cluster_bootstrap

LABELS = ("agent", "protocol", "acoustics", "look")
# Value of `look` of every agent that does not rotate to observe, not named in headings.
USUAL_LOOK = "once"
EPISODE_COLUMNS = (
    *LABELS,
    *("sound", "scene", "seed", "episode", "start_cell", "start_heading", "source", "source_cell"),
    *("in_sight", "rooms_crossed", "geodesic", "euclidean", "end_cell", "path_length", "shortest"),
    *("actions", "fewest_actions", "collisions", "outcome"),
    *("success", "spl", "softspl", "sna", "dtg"),
)
# Metrics of results.csv, and the column of episodes.csv that each is the mean of. Rates are from 0
# to 1; dtg is in metres.
METRICS = {"sr": "success", "spl": "spl", "softspl": "softspl", "sna": "sna", "dtg": "dtg"}
INTERVALS = tuple(f"{metric}_{end}" for metric in METRICS for end in ("low", "high"))
RESULT_COLUMNS = (*LABELS, "sound", "scene", "seed", "episodes", *METRICS, *INTERVALS)
ALL_SOUNDS = "all"
AVERAGE = "average"
NO_INTERVAL = f"too few sources (fewer than {MIN_CLUSTERS}) for an interval"
_PAIR = ["sound", "scene", "seed", "episode"]


def summarise(episodes: pd.DataFrame, draws: int = 2000) -> pd.DataFrame:
    """Compute the metrics by scene and sound, with confidence intervals.

    Parameters
    ----------
    episodes : DataFrame
        Records of any number of agents, protocols, sounds, scenes and seeds; see
        `avn.agents.rollout.rollout_scene`.
    draws : int
        Bootstrap resamples.

    Returns
    -------
    DataFrame
        Columns `RESULT_COLUMNS`. Scene `average` is the unweighted mean over scenes, as in the
        paper. Sound `all` pools the episodes of all sounds if there are several. Intervals are
        95 % bootstrap intervals over (scene, source) clusters, NaN where there are too few.

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
        sounds = [(str(sound), part) for sound, part in run.groupby("sound", sort=False)]
        if len(sounds) > 1:
            sounds.append((ALL_SOUNDS, run))
        for sound, part in sounds:
            scenes = [(str(scene), own) for scene, own in part.groupby("scene", sort=False)]
            for scene, own in [*scenes, (AVERAGE, part)]:
                row = {**labels, "sound": sound, "scene": scene, "episodes": len(own)}
                rows.append(row | _metrics(own, draws))
    return pd.DataFrame(rows, columns=list(RESULT_COLUMNS))


def _metrics(episodes: pd.DataFrame, draws: int) -> dict[str, float]:
    values = episodes[list(METRICS.values())].to_numpy(dtype=np.float64)
    weights = _scene_weights(episodes)
    means = weights @ values
    low, high = cluster_bootstrap(values, _clusters(episodes), weights, draws)
    metrics = dict(zip(METRICS, means.tolist(), strict=True))
    ends = np.stack((low, high), axis=1).reshape(-1)
    return metrics | dict(zip(INTERVALS, ends.tolist(), strict=True))


def _scene_weights(episodes: pd.DataFrame) -> np.ndarray:
    """Compute weights of the episodes that sum to 1 and are equal in total for all scenes."""
    sizes = episodes.groupby("scene")["scene"].transform("size").to_numpy(dtype=np.float64)
    return 1.0 / (sizes * episodes["scene"].nunique())


def _clusters(episodes: pd.DataFrame) -> np.ndarray:
    return episodes.groupby(["scene", "source"]).ngroup().to_numpy()


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


def across_seeds(results: pd.DataFrame) -> pd.DataFrame:
    """Compute mean and standard deviation of the metrics over seeds.

    Returns
    -------
    DataFrame
        One row per agent, protocol, acoustics, look, sound and scene: `seeds`, their number, and
        for each metric its mean and `<metric>_std`, the sample standard deviation (NaN for one
        seed).
    """
    groups = results.groupby([*LABELS, "sound", "scene"], sort=False)
    table = groups["seed"].nunique().rename("seeds").to_frame()
    for metric in METRICS:
        table[metric] = groups[metric].mean()
        table[f"{metric}_std"] = groups[metric].std(ddof=1)
    return table.reset_index()


def compare(one: pd.DataFrame, other: pd.DataFrame, draws: int = 2000) -> pd.DataFrame:
    """Compute paired differences between two runs over the same episodes, `one` minus `other`.

    Parameters
    ----------
    one, other : DataFrame
        Records of one run each.
    draws : int
        Bootstrap resamples over (scene, source) clusters.

    Returns
    -------
    DataFrame
        `metric`, `difference`, and its 95 % confidence interval `low`, `high`, NaN with too few
        (scene, source) clusters. Scenes have equal weight.

    Raises
    ------
    UserError
        If the runs have different episodes.
    """
    same = [*_PAIR, "source", "start_cell", "start_heading"]
    first, second = (
        run.sort_values(_PAIR, kind="stable").reset_index(drop=True) for run in (one, other)
    )
    if not first[same].equals(second[same]):
        raise UserError(
            "episodes.csv: the two runs did not walk the same episodes; run both with the same "
            "split, protocol, sound and seed"
        )
    columns = list(METRICS.values())
    values = (first[columns].to_numpy(np.float64)) - second[columns].to_numpy(np.float64)
    weights = _scene_weights(first)
    low, high = cluster_bootstrap(values, _clusters(first), weights, draws)
    return pd.DataFrame(
        {"metric": list(METRICS), "difference": weights @ values, "low": low, "high": high}
    )


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
