import math

import pytest
import torch

from avn.core.errors import UserError
from avn.modules.stop_threshold import (
    TRIES,
    approach_weights,
    best_threshold,
    error_rates,
)

# Three clips at the goal, two one move away, one two moves away.
PROBABILITY = torch.tensor([0.9, 0.8, 0.3, 0.7, 0.2, 0.1])
MOVES = torch.tensor([0, 0, 0, 1, 1, 2])


def test_error_rates_count_what_is_wrong() -> None:
    rates = error_rates(PROBABILITY, MOVES, 0.5)
    assert rates["miss"] == pytest.approx(1 / 3)
    assert rates["false_alarm"] == pytest.approx(1 / 3)
    # One of the two clips one move away, none of those two moves away.
    assert rates["false_stops"] == pytest.approx(1 / 2)


def test_rates_without_clips_are_left_out() -> None:
    assert set(error_rates(PROBABILITY[:3], MOVES[:3], 0.5)) == {"miss"}
    assert set(error_rates(PROBABILITY[3:], MOVES[3:], 0.5)) == {"false_alarm", "false_stops"}


def test_an_approach_listens_once_at_each_number_of_moves() -> None:
    assert approach_weights(MOVES).tolist() == pytest.approx([0, 0, 0, 0.5, 0.5, 1])


def test_balanced_threshold_makes_the_sum_of_errors_least() -> None:
    # Cuts: over 0.8 misses 1/3 of the goal without alarm; over 0.3 misses none and alarms 1/3.
    assert best_threshold(PROBABILITY, MOVES, "balanced") in (
        pytest.approx(0.75),
        pytest.approx(0.25),
    )
    moves = torch.tensor([0, 0, 0, 1, 1, 1])
    probability = torch.tensor([0.9, 0.8, 0.6, 0.7, 0.2, 0.1])
    moves, probability = (
        torch.cat((moves, moves[3:])),
        torch.cat((probability, probability[4:5].expand(3))),
    )
    # One alarm of six weighs less than one miss of three.
    assert best_threshold(probability, moves, "balanced") == pytest.approx(0.4)


def test_approach_threshold_is_the_best_of_all_by_its_own_measure() -> None:
    generator = torch.Generator().manual_seed(0)
    moves = torch.randint(0, 12, (4000,), generator=generator)
    noise = torch.randn(4000, generator=generator)
    probability = torch.sigmoid(1.0 - 1.5 * moves + noise)

    def merit(threshold: float) -> float:
        rates = error_rates(probability, moves, threshold)
        return math.exp(-rates["false_stops"]) * (1 - rates["miss"] ** TRIES)

    chosen = best_threshold(probability, moves, "approach")
    best = max(merit(float(cut)) for cut in torch.linspace(0.01, 0.99, 300))
    assert merit(chosen) >= best - 1e-9
    # A false stop ends the episode, a miss does not: it is the more careful one.
    assert chosen > best_threshold(probability, moves, "balanced")


def test_scores_that_are_equal_are_not_parted() -> None:
    probability = torch.tensor([0.6, 0.6, 0.6, 0.2])
    moves = torch.tensor([0, 0, 1, 1])
    assert best_threshold(probability, moves, "balanced") == pytest.approx(0.4)


def test_perfect_scores_give_a_threshold_between() -> None:
    probability, moves = torch.tensor([0.9, 0.7, 0.3]), torch.tensor([0, 0, 4])
    for criterion in ("approach", "balanced"):
        threshold = best_threshold(probability, moves, criterion)
        assert threshold == pytest.approx(0.5)
        assert error_rates(probability, moves, threshold) == {
            "miss": 0,
            "false_alarm": 0,
            "false_stops": 0,
        }


def test_what_cannot_be_chosen_is_one_line() -> None:
    with pytest.raises(UserError, match=r"stop_model.criterion: 'best' is none of approach"):
        best_threshold(PROBABILITY, MOVES, "best")
    with pytest.raises(UserError, match="all its clips are at the goal, or none"):
        best_threshold(PROBABILITY, torch.ones(6), "balanced")
