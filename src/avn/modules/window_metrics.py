"""How well windows are known: accuracy, ROC AUC, calibration, over all cells and visible ones."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torchmetrics import Metric
from torchmetrics.functional.classification import (
    binary_accuracy,
    binary_auroc,
    binary_calibration_error,
)
from torchmetrics.utilities.data import dim_zero_cat

BINS = 15


def window_metrics(probability: Tensor, free: Tensor, visible: Tensor) -> dict[str, float]:
    """Judge windows.

    Parameters
    ----------
    probability : (N, 5, 5) float tensor
        That each cell is free.
    free, visible : (N, 5, 5) bool tensors
        Whether it is, and whether the camera sees any of it.

    Returns
    -------
    dict
        `accuracy`, `auc`, `ece` (expected calibration error in 15 bins) and `loss`
        (cross-entropy), each over `all` cells and over `visible` ones, such as `auc/visible`. A
        figure that lacks free or taken cells is left out.
    """
    figures: dict[str, float] = {}
    for name, chosen in (("all", torch.ones_like(visible)), ("visible", visible)):
        said, found = probability[chosen].double(), free[chosen].int()
        if not len(said):
            continue
        figures[f"accuracy/{name}"] = float(binary_accuracy(said, found))
        figures[f"ece/{name}"] = float(binary_calibration_error(said, found, n_bins=BINS))
        loss = nn.functional.binary_cross_entropy(said, found.double())
        figures[f"loss/{name}"] = float(loss)
        if 0 < int(found.sum()) < len(found):
            figures[f"auc/{name}"] = float(binary_auroc(said, found))
    return figures


def temperature(log_odds: Tensor, label: Tensor, steps: int = 40) -> Tensor:
    """The number by which to divide log-odds so that the cross-entropy is least.

    By golden section over its logarithm, between 1/8 and 8.

    Parameters
    ----------
    log_odds, label : (...) float tensors
    steps : int
        Each makes the interval smaller by 0.62.
    """
    log_odds, label = log_odds.double(), label.double()

    def loss(power: float) -> float:
        scaled = log_odds / 2**power
        return float(nn.functional.binary_cross_entropy_with_logits(scaled, label))

    low, high, ratio = -3.0, 3.0, (5**0.5 - 1) / 2
    for _ in range(steps):
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        if loss(left) < loss(right):
            high = right
        else:
            low = left
    return torch.tensor(2 ** ((low + high) / 2))


class WindowScores(Metric):
    """Gathers log-odds of windows and judges them.

    Attributes
    ----------
    temperature : (2,) tensor
        By which log-odds of free and of visible are divided.
    """

    full_state_update = False

    def __init__(self) -> None:
        super().__init__()
        for state in ("log_odds", "free", "visible"):
            self.add_state(state, default=[], dist_reduce_fx="cat")
        self.temperature = torch.ones(2)

    def update(self, log_odds: Tensor, free: Tensor, visible: Tensor) -> None:
        """Take in N windows.

        Parameters
        ----------
        log_odds : (N, 2, 5, 5) float tensor, of free and of visible
        free : (N, 5, 5) float tensor
        visible : (N, 5, 5) bool tensor
        """
        self.log_odds.append(log_odds)  # type: ignore[union-attr, operator]
        self.free.append(free)  # type: ignore[union-attr, operator]
        self.visible.append(visible)  # type: ignore[union-attr, operator]

    def answers(self) -> tuple[Tensor, Tensor, Tensor]:
        """All that was taken in: log-odds (N, 2, 5, 5), free and visible (N, 5, 5)."""
        log_odds, free, visible = (
            dim_zero_cat(getattr(self, state)) for state in ("log_odds", "free", "visible")
        )
        return log_odds, free, visible

    def compute(self) -> dict[str, float]:
        """Those of `window_metrics`, and `auc/sight` of the estimates of what is visible."""
        log_odds, free, visible = self.answers()
        said = torch.sigmoid(log_odds / self.temperature[:, None, None])
        figures = window_metrics(said[:, 0], free.bool(), visible)
        figures["auc/sight"] = float(binary_auroc(said[:, 1].flatten(), visible.int().flatten()))
        return figures
