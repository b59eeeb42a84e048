"""Localisation errors of a spatial memory."""

from __future__ import annotations

import pandas as pd
import torch
from torch import Tensor

from avn.apartments.floor_plan import CELL
from avn.core.actions import HEADINGS
from avn.mapping.spatial_memory import SpatialMemory, distinct, locate

WALKED, OTHER, ALL = "walked", "other", "all"


def place_errors(lattice: Tensor, features: Tensor, trajectories: Tensor, top: int) -> pd.DataFrame:
    """Compute the errors of the poses that memories of trajectories return for every view.

    Parameters
    ----------
    lattice : (C, 2) int64 tensor
        Column and row of each cell.
    features : (S, D) float32 tensor
        l2-normalised features of the views of all S = 4 C states.
    trajectories : (W, T) int64 tensor
        States of exploration trajectories; each has a memory of its own.
    top : int
        Entries that an estimate averages.

    Returns
    -------
    DataFrame
        Rows `walked` for views from cells that the trajectory visited, `other` for the rest, and
        `all`. Columns: cells; views, over all trajectories; error_m and error_mean_m, the median
        and mean distance in metres; heading, the share of views with the right heading. Statistics
        of no views are NaN.
    """
    states = torch.arange(len(features))
    true = torch.cat((lattice[states // HEADINGS], states[:, None] % HEADINGS), dim=1)
    keys, values = distinct(features[trajectories], true[trajectories])
    metres, right, walked = [], [], []
    own = torch.zeros(len(states), dtype=torch.int64)
    for trajectory, *memory in zip(trajectories, keys, values, strict=True):
        found = locate(*SpatialMemory(memory[0][None], memory[1][None], own, top).recall(features))
        metres.append(CELL * (found[:, :2] - true[:, :2]).norm(dim=1))
        right.append(found[:, 2] == true[:, 2])
        walked.append(torch.isin(states // HEADINGS, trajectory // HEADINGS))
    error, heading, there = (torch.cat(each) for each in (metres, right, walked))
    groups = ((WALKED, there), (OTHER, ~there), (ALL, there | True))
    rows = [
        {
            "cells": cells,
            "views": int(chosen.sum()),
            "error_m": float(error[chosen].quantile(0.5)) if chosen.any() else float("nan"),
            "error_mean_m": float(error[chosen].mean()),
            "heading": float(heading[chosen].double().mean()),
        }
        for cells, chosen in groups
    ]
    return pd.DataFrame(rows)
