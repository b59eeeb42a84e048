"""Errors of the direction of arrival and of the length of the path."""

from __future__ import annotations

import math

import torch
from torch import Tensor
from torchmetrics import Metric
from torchmetrics.utilities.data import dim_zero_cat

from avn.core.heard import Arrivals
from avn.modules.sound_metrics import SIGHTS


def arrival_errors(heard: Arrivals, target: Tensor) -> tuple[Tensor, Tensor]:
    """Compute the errors of N estimates.

    Parameters
    ----------
    heard : Arrivals
        Estimates, (N, bins + 6).
    target : (N, 5) tensor
        See `avn.modules.arrival_cnn.ArrivalCnn.loss`.

    Returns
    -------
    degrees, logs : (N,) tensors
        Error of the direction, whose estimate is the mean of the distribution as a vector, 0 to
        180 degrees, and of the logarithm of the length.
    """
    angles = torch.arange(heard.bins) * (2 * math.pi / heard.bins)
    mean = heard.bearing.exp() @ torch.stack((angles.sin(), angles.cos()), 1)
    cross = mean[:, 0] * target[:, 1] - mean[:, 1] * target[:, 0]
    dot = (mean * target[:, :2]).sum(1)
    degrees = torch.rad2deg(torch.atan2(cross.abs(), dot))
    return degrees, (heard.distance[:, 0] - target[:, 2]).abs()


class ArrivalErrors(Metric):
    """Median errors of arrivals, in sight and out of sight.

    The direction is the mean of the distribution over bins, as a vector.
    """

    full_state_update = False

    def __init__(self) -> None:
        super().__init__()
        for state in ("degrees", "logs", "in_sight"):
            self.add_state(state, default=[], dist_reduce_fx="cat")

    def update(self, heard: Arrivals, target: Tensor, in_sight: Tensor) -> None:
        """Add N estimates.

        Parameters
        ----------
        heard : Arrivals
            Estimates, (N, bins + 6).
        target : (N, 5) tensor
            See `avn.modules.arrival_cnn.ArrivalCnn.loss`.
        in_sight : (N,) bool tensor
            Whether the source is in sight.
        """
        there = target[:, :2].square().sum(1) > 0
        degrees, logs = arrival_errors(heard, target)
        self.degrees.append(degrees[there])  # type: ignore[union-attr, operator]
        self.logs.append(logs[there])  # type: ignore[union-attr, operator]
        self.in_sight.append(in_sight[there])  # type: ignore[union-attr, operator]

    def compute(self) -> dict[tuple[str, str], Tensor]:
        """Return medians by kind (`arrival_deg`, `log_length`) and sight."""
        degrees, logs, in_sight = (
            dim_zero_cat(getattr(self, state)) for state in ("degrees", "logs", "in_sight")
        )
        medians: dict[tuple[str, str], Tensor] = {}
        for sight, group in zip(SIGHTS, (in_sight, ~in_sight), strict=True):
            if group.any():
                medians["arrival_deg", sight] = torch.quantile(degrees[group], 0.5)
                medians["log_length", sight] = torch.quantile(logs[group], 0.5)
        return medians
