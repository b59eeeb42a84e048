"""Tables of how well networks hear, see and recognise, beside a run's results."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from rich.table import Table


def heard_table(heard: pd.DataFrame) -> Table:
    """What a sound network hears, by sound and sight: means over the rooms of the room medians.

    Parameters
    ----------
    heard : DataFrame
        As `avn.pipeline.audio_inference.sound_errors` gives it, of any number of rooms.
    """
    columns = ("metres off", "degrees off", "over 90 degrees off")
    table = _table("what is heard, medians of the rooms", columns)
    figures = ["error_m", "bearing_deg", "front_back"]
    means = heard.groupby(["sound", "sight"], as_index=False, sort=False)[figures].mean()
    for row in means.to_dict("records"):
        label = f"{row['sound']}, {row['sight'].replace('_', ' ')}"
        metres, degrees = f"{row['error_m']:.2f}", f"{row['bearing_deg']:.0f}"
        table.add_row(label, metres, degrees, f"{100 * row['front_back']:.0f} %")
    return table


def windows_table(seen: pd.DataFrame) -> Table:
    """How well free cells are seen, over the views of all rooms, beside the prior.

    Parameters
    ----------
    seen : DataFrame
        As `avn.pipeline.occupancy.window_errors` gives it.
    """
    columns = ("ROC AUC", "accuracy", "calibration error")
    table = _table("which cells look free", columns)
    for row in seen[seen["scene"] == "all"].to_dict("records"):
        label = f"{row['by']}, {row['cells']} cells"
        table.add_row(
            label, f"{row['auc']:.3f}", f"{100 * row['accuracy']:.1f} %", f"{row['ece']:.3f}"
        )
    return table


def places_table(places: pd.DataFrame) -> Table:
    """How far the places that memories return are off: means over the rooms.

    Parameters
    ----------
    places : DataFrame
        As `avn.mapping.place_errors.place_errors` gives it, of any number of rooms.
    """
    columns = ("metres off, median", "mean", "heading right")
    table = _table("where views are recognised, means of the rooms", columns)
    figures = ["error_m", "error_mean_m", "heading"]
    means = places.groupby("cells", as_index=False, sort=False)[figures].mean()
    for row in means.to_dict("records"):
        median, mean = f"{row['error_m']:.2f}", f"{row['error_mean_m']:.2f}"
        table.add_row(f"{row['cells']} cells", median, mean, f"{100 * row['heading']:.0f} %")
    return table


def _table(title: str, columns: Sequence[str]) -> Table:
    table = Table(title=title, box=None, pad_edge=False, title_justify="left")
    table.add_column("", no_wrap=True)
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    return table
