import math

import pytest
import torch

from avn.modules.local_patch_metrics import (
    LocalPatchScores,
    calibrated,
    calibration,
    local_patch_metrics,
)


def patch(*values: float) -> torch.Tensor:
    """One patch whose first cells have these values; the others are 0."""
    cells = torch.zeros(25)
    cells[: len(values)] = torch.tensor(values)
    return cells.reshape(1, 5, 5)


def test_metrics_of_hand_made_patches() -> None:
    said = patch(0.9, 0.6, 0.4, 0.2)
    free = patch(1, 0, 1, 0).bool()
    visible = patch(1, 1, 1, 1).bool()
    found = local_patch_metrics(said, free, visible)
    # Of the four pairs of a free and a taken cell, (0.4, 0.6) alone is the wrong way round.
    assert found["auc/visible"] == pytest.approx(3 / 4)
    assert found["accuracy/visible"] == pytest.approx(1 / 2)
    # Four cells in bins of their own: 0.1, 0.6, 0.6 and 0.2 off.
    assert found["ece/visible"] == pytest.approx((0.1 + 0.6 + 0.6 + 0.2) / 4, abs=1e-6)
    loss = -sum(map(math.log, (0.9, 0.4, 0.4, 0.8))) / 4
    assert found["loss/visible"] == pytest.approx(loss)
    # The other 21 cells are taken and said to be: two of the 25 are wrong.
    assert found["accuracy/all"] == pytest.approx(23 / 25)


def test_a_figure_that_cannot_be_is_left_out() -> None:
    free, visible = torch.ones(1, 5, 5).bool(), torch.zeros(1, 5, 5).bool()
    found = local_patch_metrics(torch.full((1, 5, 5), 0.5), free, visible)
    assert "auc/all" not in found
    assert not any(name.endswith("visible") for name in found)


def test_calibration_finds_the_factor_and_shift_that_spoilt_it() -> None:
    generator = torch.Generator().manual_seed(0)
    true = torch.randn(40000, generator=generator) * 2
    label = (torch.rand(40000, generator=generator) < torch.sigmoid(true)).float()
    # A network three times as sure as it should be, and shifted.
    fitted = calibration(3 * true + 1, label)
    assert float(fitted[0]) == pytest.approx(1 / 3, rel=0.05)
    assert float(fitted[1]) == pytest.approx(-1 / 3, abs=0.05)
    kept = calibration(true, label)
    assert kept.tolist() == pytest.approx([1, 0], abs=0.05)


def test_calibration_stays_finite_where_nothing_is_wrong() -> None:
    log_odds = torch.tensor([5.0, -5.0])
    factor, shift = calibration(log_odds, torch.tensor([1.0, 0.0])).tolist()
    low, high = sorted(torch.sigmoid(factor * log_odds + shift).tolist())
    assert low < 0.1 < 0.9 < high  # as sure as two cells and the two of the prior allow
    assert shift == pytest.approx(0.0, abs=1e-3)
    # all are free: it believes so, by finite numbers
    log_odds = torch.tensor([1.0, 2.0] * 50)
    factor, shift = calibration(log_odds, torch.ones(100)).tolist()
    said = torch.sigmoid(factor * log_odds + shift)
    assert 0.9 < float(said.min()) <= float(said.max()) <= 1.0


def test_scores_gather_batches() -> None:
    generator = torch.Generator().manual_seed(0)
    log_odds = torch.randn(6, 2, 5, 5, generator=generator)
    free = (torch.rand(6, 5, 5, generator=generator) < 0.5).float()
    visible = torch.rand(6, 5, 5, generator=generator) < 0.5
    scores = LocalPatchScores()
    scores.calibration = torch.tensor(((2.0, 0.5), (1.0, 0.0)))
    for part in (slice(0, 4), slice(4, 6)):
        scores.update(log_odds[part], free[part], visible[part], free[part])
    said = calibrated(log_odds, scores.calibration)
    torch.testing.assert_close(said[:, 0], torch.sigmoid(2 * log_odds[:, 0] + 0.5))
    found = scores.compute()
    assert found.pop("auc/sight") > 0
    assert found == local_patch_metrics(said[:, 0], free.bool(), visible)
