"""TensorBoard events of a run: its row in the HPARAMS tab, and curves over the distance."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import pandas as pd
from omegaconf import DictConfig

from avn.acoustics.sound_names import joined_names
from avn.pipeline.sounds import sound_files
from avn.reporting import results
from avn.reporting.breakdown import DISTANCES, breakdown
from avn.reporting.events import write_summary


def write_events(
    cfg: DictConfig,
    folder: Path,
    episodes: pd.DataFrame,
    summary: pd.DataFrame,
    read: Collection[str],
) -> None:
    """Write the events of a run.

    The curves are success rate and SPL by geodesic distance of the start: a step is the lower bound
    of a group of distances in metres.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.eval`.
    folder : Path
        Folder of the run.
    episodes, summary : DataFrame
        `episodes.csv` and `results.csv`.
    read : collection of str
        Keys of the settings that the run reads; others are left out.
    """
    means = results.headline(summary)
    metrics = {"success": means.pop("sr"), **means}
    table = breakdown(episodes, "distance", draws=0)
    steps = [DISTANCES[group] for group in _groups(table)]
    curves = {
        f"by_distance/{name}": dict(zip(steps, table[column].tolist(), strict=True))
        for name, column in (("success", "sr"), ("spl", "spl"))
    }
    write_summary(folder, _settings(cfg, read), metrics, curves)


def _groups(table: pd.DataFrame) -> list[int]:
    """Return the number of each row's group of distances, whose labels begin with the bound."""
    return [DISTANCES.index(int(str(group).split()[0])) for group in table["group"]]


def _settings(cfg: DictConfig, read: Collection[str]) -> dict[str, Any]:
    nodes = {key.split(".")[0] for key in read}
    leaves = {key.rsplit(".", 1)[-1] for key in read}
    settings = {key: cfg[key].name for key in ("agent", "protocol", "acoustics", "split")}
    settings |= {"kind": "run", "sound": joined_names(sound_files(cfg))}
    parts = ("sound_model", "mapper", "planner")
    settings |= {key: cfg[key].name for key in parts if key in nodes}
    scalars = ("seed", "train_seed", "episodes", "subset", "look", "exploration", "localisation")
    return settings | {key: cfg[key] for key in scalars if key in leaves}
