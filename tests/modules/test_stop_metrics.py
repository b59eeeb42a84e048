import pytest
import torch

from avn.modules.stop_metrics import StopScores

# Three clips at the goal, two one move away, one two moves away.
PROBABILITY = torch.tensor([0.9, 0.8, 0.3, 0.7, 0.2, 0.1])
MOVES = torch.tensor([0, 0, 0, 1, 1, 2])


def test_auc_is_the_share_of_pairs_in_the_right_order() -> None:
    scores = StopScores(["ring", "clock"])
    in_sight = torch.tensor([True, True, True, True, False, False])
    sound = torch.tensor([0, 1, 0, 1, 0, 1])
    # In two parts, as batches come.
    for part in (slice(0, 4), slice(4, 6)):
        scores.update(PROBABILITY[part], MOVES[part], in_sight[part], sound[part])
    found = scores.compute()
    # 9 pairs, of which (0.3, 0.7) alone stands in the wrong order.
    assert float(found["auc/all/all"]) == pytest.approx(8 / 9)
    assert float(found["auc/in_sight/all"]) == pytest.approx(2 / 3)
    # Ring: goal 0.9 and 0.3, elsewhere 0.2. Out of sight nothing is at the goal.
    assert float(found["auc/all/ring"]) == pytest.approx(1.0)
    assert "auc/out_of_sight/all" not in found
    assert scores.at(0.5)["miss/all/ring"] == pytest.approx(0.5)
    assert scores.at(0.5)["false_alarm/out_of_sight/all"] == 0


def test_calibration_error_of_hand_made_scores() -> None:
    scores = StopScores(["ring"])
    nothing = torch.zeros(4, dtype=torch.int64)
    # Said 0.9 and half of them true: 0.4 off.
    scores.update(torch.full((4,), 0.9), torch.tensor([0, 0, 1, 1]), nothing.bool(), nothing)
    assert float(scores.compute()["ece/all/all"]) == pytest.approx(0.4, abs=1e-6)
