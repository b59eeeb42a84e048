"""Records of episodes, their figures by room and sound, and the files that hold both."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.navigation.metrics import cluster_bootstrap

LABELS = ("agent", "protocol", "acoustics", "look")
EPISODE_COLUMNS = (
    *LABELS,
    *("sound", "scene", "seed", "episode", "start_cell", "start_heading", "source", "source_cell"),
    *("in_sight", "rooms_crossed", "geodesic", "euclidean", "end_cell", "path_length", "shortest"),
    *("actions", "fewest_actions", "collisions", "outcome"),
    *("success", "spl", "softspl", "sna", "dtg"),
)
# The figures of results.csv, and the column of episodes.csv that each is the mean of. Shares are
# between 0 and 1; dtg is in metres.
FIGURES = {"sr": "success", "spl": "spl", "softspl": "softspl", "sna": "sna", "dtg": "dtg"}
INTERVALS = tuple(f"{figure}_{end}" for figure in FIGURES for end in ("low", "high"))
RESULT_COLUMNS = (*LABELS, "sound", "scene", "seed", "episodes", *FIGURES, *INTERVALS)
ALL_SOUNDS = "all"
AVERAGE = "average"
_PAIR = ["sound", "scene", "seed", "episode"]


def summarise(episodes: pd.DataFrame, draws: int = 2000) -> pd.DataFrame:
    """Figures by room and sound, with intervals.

    Parameters
    ----------
    episodes : DataFrame
        Records as `avn.agents.rollout.rollout_scene` makes them; any number of agents, protocols,
        sounds, rooms and seeds.
    draws : int
        Resamples of the bootstrap.

    Returns
    -------
    DataFrame
        Columns `RESULT_COLUMNS`. Room `average` is the mean over the rooms, each counting the
        same, as in the paper; sound `all`, where there is more than one, takes the episodes of
        all sounds together. Intervals are 95 % bootstrap intervals over (room, source) clusters.

    Raises
    ------
    UserError
        Where there is no episode.
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
            rooms = [(str(room), own) for room, own in part.groupby("scene", sort=False)]
            for room, own in [*rooms, (AVERAGE, part)]:
                row = {**labels, "sound": sound, "scene": room, "episodes": len(own)}
                rows.append(row | _figures(own, draws))
    return pd.DataFrame(rows, columns=list(RESULT_COLUMNS))


def _figures(episodes: pd.DataFrame, draws: int) -> dict[str, float]:
    values = episodes[list(FIGURES.values())].to_numpy(dtype=np.float64)
    weights = _room_weights(episodes)
    means = weights @ values
    low, high = cluster_bootstrap(values, _clusters(episodes), weights, draws)
    figures = dict(zip(FIGURES, means.tolist(), strict=True))
    ends = np.stack((low, high), axis=1).reshape(-1)
    return figures | dict(zip(INTERVALS, ends.tolist(), strict=True))


def _room_weights(episodes: pd.DataFrame) -> np.ndarray:
    """Weights that sum to 1 and give every room the same share, however many episodes it has."""
    sizes = episodes.groupby("scene")["scene"].transform("size").to_numpy(dtype=np.float64)
    return 1.0 / (sizes * episodes["scene"].nunique())


def _clusters(episodes: pd.DataFrame) -> np.ndarray:
    return episodes.groupby(["scene", "source"]).ngroup().to_numpy()


def headline(results: pd.DataFrame) -> dict[str, float]:
    """The figures over all rooms and sounds of one run, such as for TensorBoard's hparams.

    Raises
    ------
    ValueError
        Where the results hold more than one agent, protocol or seed.
    """
    average = results[results["scene"] == AVERAGE]
    if len(average) > 1:
        average = average[average["sound"] == ALL_SOUNDS]
    if len(average) != 1:
        raise ValueError(f"results of one run have one average, these have {len(average)}")
    return {figure: float(average.iloc[0][figure]) for figure in FIGURES}


def across_seeds(results: pd.DataFrame) -> pd.DataFrame:
    """Mean and spread over the seeds of a sweep.

    Returns
    -------
    DataFrame
        One row by agent, protocol, acoustics, look, sound and room: `seeds`, how many, and for
        each figure its mean and `<figure>_std`, the sample standard deviation (NaN for one seed).
    """
    groups = results.groupby([*LABELS, "sound", "scene"], sort=False)
    table = groups["seed"].nunique().rename("seeds").to_frame()
    for figure in FIGURES:
        table[figure] = groups[figure].mean()
        table[f"{figure}_std"] = groups[figure].std(ddof=1)
    return table.reset_index()


def compare(one: pd.DataFrame, other: pd.DataFrame, draws: int = 2000) -> pd.DataFrame:
    """Paired differences between two runs over the same episodes, `one` less `other`.

    Parameters
    ----------
    one, other : DataFrame
        Records of one run each.

    Returns
    -------
    DataFrame
        By figure: `difference`, `low`, `high`; rooms count the same, and intervals are bootstrapped
        over (room, source) clusters.

    Raises
    ------
    UserError
        Where the two did not walk the same episodes.
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
    columns = list(FIGURES.values())
    values = (first[columns].to_numpy(np.float64)) - second[columns].to_numpy(np.float64)
    weights = _room_weights(first)
    low, high = cluster_bootstrap(values, _clusters(first), weights, draws)
    return pd.DataFrame(
        {"figure": list(FIGURES), "difference": weights @ values, "low": low, "high": high}
    )


def write_csv(table: pd.DataFrame, path: Path) -> None:
    """Write a table whole or not at all."""
    with atomic_write(path) as part:
        table.to_csv(part, index=False, lineterminator="\n")


def read_csv(path: Path) -> pd.DataFrame:
    """Read a table of this module back; names stay text, also a sound called 440 or nan."""
    names = dict.fromkeys((*LABELS, "sound", "scene", "outcome"), str)
    return pd.read_csv(path, dtype=names, keep_default_na=False, na_values=[""])
