"""Metrics of local patches: accuracy, ROC AUC and calibration, over all and visible cells."""

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
STATES = ("log_odds", "free", "visible", "rooms")


def local_patch_metrics(probability: Tensor, free: Tensor, visible: Tensor) -> dict[str, float]:
    """Compute metrics of estimated local patches.

    Parameters
    ----------
    probability : (N, 5, 5) float tensor
        Estimated probability that each cell is free.
    free, visible : (N, 5, 5) bool tensors
        Whether each cell is free, and whether the camera sees any of it.

    Returns
    -------
    dict of str to float
        `accuracy`, `auc`, `ece` (expected calibration error in 15 bins) and `loss`
        (cross-entropy), each over `all` cells and over `visible` ones, such as `auc/visible`. The
        AUC of cells of one class only and metrics without any cell are left out.
    """
    metrics: dict[str, float] = {}
    for name, cells in (("all", torch.ones_like(visible)), ("visible", visible)):
        prediction, label = probability[cells].double(), free[cells].int()
        if not len(prediction):
            continue
        metrics[f"accuracy/{name}"] = float(binary_accuracy(prediction, label))
        metrics[f"ece/{name}"] = float(binary_calibration_error(prediction, label, n_bins=BINS))
        loss = nn.functional.binary_cross_entropy(prediction, label.double())
        metrics[f"loss/{name}"] = float(loss)
        if 0 < int(label.sum()) < len(label):
            metrics[f"auc/{name}"] = float(binary_auroc(prediction, label))
    return metrics


def calibration(log_odds: Tensor, label: Tensor, steps: int = 30) -> Tensor:
    """Fit the scale and offset of log-odds that minimise the cross-entropy (Platt scaling).

    Platt, "Probabilistic outputs for support vector machines" (1999), by Newton's method. Two
    pseudo-examples of log-odds 0, one of each class, keep the result finite.

    Parameters
    ----------
    log_odds, label : (...) float tensors
        Log-odds, and labels 0 or 1.
    steps : int
        Number of Newton steps.

    Returns
    -------
    (2,) float32 tensor
        Scale, 0.05 or more, and offset.
    """
    logits = torch.cat((log_odds.flatten().double(), torch.zeros(2).double()))
    label = torch.cat((label.flatten().double(), torch.tensor((0.0, 1.0)).double()))
    inputs = torch.stack((logits, torch.ones_like(logits)), 1)
    fitted = torch.tensor((1.0, 0.0), dtype=torch.float64)
    for _ in range(steps):
        prediction = torch.sigmoid(inputs @ fitted)
        slope = inputs.T @ (prediction - label)
        curvature = (inputs * (prediction * (1 - prediction))[:, None]).T @ inputs
        step = torch.linalg.solve(curvature + 1e-6 * torch.eye(2).double(), slope)
        fitted = fitted - step.clamp(-1.0, 1.0)
    fitted[0].clamp_(min=0.05)
    return fitted.float()


def calibrated(log_odds: Tensor, fitted: Tensor) -> Tensor:
    """Return calibrated probabilities (N, k, 5, 5).

    Parameters
    ----------
    log_odds : (N, k, 5, 5) float tensor
        Log-odds of free, of visible and, if k = 3, of being part of a room.
    fitted : (k, 2) float tensor
        Scale and offset of each, as `calibration` gives them.
    """
    factor, shift = fitted[:, :, None, None].unbind(1)
    return torch.sigmoid(log_odds * factor + shift)


class LocalPatchScores(Metric):
    """Metrics of local patches over all batches of an epoch.

    Attributes
    ----------
    calibration : (k, 2) tensor
        Scale and offset of the log-odds; see `calibrated`.
    """

    full_state_update = False

    def __init__(self) -> None:
        super().__init__()
        for state in STATES:
            self.add_state(state, default=[], dist_reduce_fx="cat")
        self.calibration = torch.tensor(((1.0, 0.0), (1.0, 0.0)))

    def update(self, log_odds: Tensor, free: Tensor, visible: Tensor, rooms: Tensor) -> None:
        """Add N local patches.

        Parameters
        ----------
        log_odds : (N, k, 5, 5) float tensor
            Estimated log-odds; see `calibrated`.
        free : (N, 5, 5) float tensor
            1 where a cell is free, else 0.
        visible : (N, 5, 5) bool tensor
            Whether the camera sees any of a cell.
        rooms : (N, 5, 5) float tensor
            1 where a cell is part of a room, else 0.
        """
        self.log_odds.append(log_odds)  # type: ignore[union-attr, operator]
        self.free.append(free)  # type: ignore[union-attr, operator]
        self.visible.append(visible)  # type: ignore[union-attr, operator]
        self.rooms.append(rooms)  # type: ignore[union-attr, operator]

    def gathered(self) -> tuple[Tensor, ...]:
        """Return all that was added: log-odds (N, k, 5, 5), and free, visible, rooms (N, 5, 5)."""
        return tuple(dim_zero_cat(getattr(self, state)) for state in STATES)

    def compute(self) -> dict[str, float]:
        """Return `local_patch_metrics`, `auc/sight` and, where they are estimated, `auc/rooms`.

        `auc/sight` is the AUC of visible against hidden, `auc/rooms` that of rooms against the
        rest, over visible cells.
        """
        log_odds, free, visible, rooms = self.gathered()
        prediction = calibrated(log_odds, self.calibration)
        metrics = local_patch_metrics(prediction[:, 0], free.bool(), visible)
        auc = binary_auroc(prediction[:, 1].flatten(), visible.int().flatten())
        metrics["auc/sight"] = float(auc)
        if prediction.shape[1] > 2 and 0 < rooms[visible].sum() < visible.sum():
            auc = binary_auroc(prediction[:, 2][visible], rooms[visible].int())
            metrics["auc/rooms"] = float(auc)
        return metrics
