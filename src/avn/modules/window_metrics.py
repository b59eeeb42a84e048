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


def calibration(log_odds: Tensor, label: Tensor, steps: int = 30) -> Tensor:
    """Factor and shift of log-odds with which the cross-entropy is least.

    Platt, "Probabilistic outputs for support vector machines" (1999), by Newton's method, with
    two cells more, one of each kind, for which it says a half, so that it is always finite.

    Parameters
    ----------
    log_odds, label : (...) float tensors
        Labels are 0 or 1.
    steps : int

    Returns
    -------
    (2,) float32 tensor
        The factor is no less than 0.05.
    """
    said = torch.cat((log_odds.flatten().double(), torch.zeros(2).double()))
    label = torch.cat((label.flatten().double(), torch.tensor((0.0, 1.0)).double()))
    inputs = torch.stack((said, torch.ones_like(said)), 1)
    fitted = torch.tensor((1.0, 0.0), dtype=torch.float64)
    for _ in range(steps):
        found = torch.sigmoid(inputs @ fitted)
        slope = inputs.T @ (found - label)
        curvature = (inputs * (found * (1 - found))[:, None]).T @ inputs
        step = torch.linalg.solve(curvature + 1e-6 * torch.eye(2).double(), slope)
        fitted = fitted - step.clamp(-1.0, 1.0)
    fitted[0].clamp_(min=0.05)
    return fitted.float()


def calibrated(log_odds: Tensor, fitted: Tensor) -> Tensor:
    """Probabilities (N, 2, 5, 5) of log-odds, with a factor and a shift (2, 2) of either kind."""
    factor, shift = fitted[:, :, None, None].unbind(1)
    return torch.sigmoid(log_odds * factor + shift)


class WindowScores(Metric):
    """Gathers log-odds of windows and judges them.

    Attributes
    ----------
    calibration : (2, 2) tensor
        Factor and shift of the log-odds of free and of visible; see `calibrated`.
    """

    full_state_update = False

    def __init__(self) -> None:
        super().__init__()
        for state in ("log_odds", "free", "visible"):
            self.add_state(state, default=[], dist_reduce_fx="cat")
        self.calibration = torch.tensor(((1.0, 0.0), (1.0, 0.0)))

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
        said = calibrated(log_odds, self.calibration)
        figures = window_metrics(said[:, 0], free.bool(), visible)
        figures["auc/sight"] = float(binary_auroc(said[:, 1].flatten(), visible.int().flatten()))
        return figures
