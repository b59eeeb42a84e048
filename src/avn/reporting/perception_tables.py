"""Tables of perception errors of a run: source estimates, local patches, localisation."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from rich.table import Table

from avn.reporting.results import ALL_SOUNDS


def source_estimates_table(source_estimates: pd.DataFrame) -> Table:
    """Tabulate the errors of source estimates by sound and line of sight.

    Values are means over scenes of the medians of each scene.

    Parameters
    ----------
    source_estimates : DataFrame
        Errors of any number of scenes; see `avn.pipeline.audio_inference.source_estimate_errors`.
    """
    columns = ("error, m", "bearing error, degrees", "bearing error > 90 degrees")
    table = _table("source estimates: mean over scenes of the median error", columns)
    metrics = ["error_m", "bearing_deg", "front_back"]
    means = source_estimates.groupby(["sound", "sight"], as_index=False, sort=False)[metrics].mean()
    if means["sound"].nunique() == 2:  # one sound, and the same again as `all`
        means = means[means["sound"] != ALL_SOUNDS]
    for row in means.to_dict("records"):
        label = f"{row['sound']}, {row['sight'].replace('_', ' ')}"
        metres, degrees = f"{row['error_m']:.2f}", f"{row['bearing_deg']:.0f}"
        table.add_row(label, metres, degrees, f"{100 * row['front_back']:.0f} %")
    return table


def arrivals_table(arrivals: pd.DataFrame) -> Table:
    """Tabulate the errors of how sound is heard to arrive, as means over scenes.

    Parameters
    ----------
    arrivals : DataFrame
        Errors of any number of scenes; see `avn.pipeline.arrival_errors.errors_by_scene`.
    """
    columns = ("direction, degrees", "direction > 90 degrees", "log of the length")
    table = _table("arrivals: mean over scenes of the median error of single clips", columns)
    metrics = ["arrival_deg", "behind", "log_length"]
    means = arrivals.groupby("sight", as_index=False, sort=False)[metrics].mean()
    for row in means.to_dict("records"):
        degrees, share = f"{row['arrival_deg']:.0f}", f"{100 * row['behind']:.0f} %"
        table.add_row(row["sight"].replace("_", " "), degrees, share, f"{row['log_length']:.2f}")
    return table


def local_patches_table(seen: pd.DataFrame) -> Table:
    """Tabulate the accuracy of predicted local occupancy patches, beside that of the prior.

    Parameters
    ----------
    seen : DataFrame
        Errors over the views of all scenes; see `avn.pipeline.occupancy.local_patch_errors`.
    """
    columns = ("ROC AUC", "accuracy", "calibration error")
    table = _table("local patches: prediction of free cells", columns)
    for row in seen[seen["scene"] == "all"].to_dict("records"):
        label = f"{row['by']}, {row['cells']} cells"
        table.add_row(
            label, f"{row['auc']:.3f}", f"{100 * row['accuracy']:.1f} %", f"{row['ece']:.3f}"
        )
    return table


def localisation_table(places: pd.DataFrame) -> Table:
    """Tabulate the errors of visual localisation by memory retrieval, as means over scenes.

    Parameters
    ----------
    places : DataFrame
        Errors of any number of scenes; see `avn.mapping.place_errors.place_errors`.
    """
    columns = ("median error, m", "mean error, m", "heading correct")
    table = _table("localisation by memory retrieval: means over scenes", columns)
    metrics = ["error_m", "error_mean_m", "heading"]
    means = places.groupby("cells", as_index=False, sort=False)[metrics].mean()
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
