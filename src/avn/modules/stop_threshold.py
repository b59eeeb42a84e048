"""Stop threshold of a stop classifier: its error rates, and its selection."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from avn.core.errors import UserError

# Clips that an agent hears at the goal before it leaves again.
TRIES = 2


def error_rates(probability: Tensor, moves: Tensor, threshold: float) -> dict[str, float]:
    """Compute the error rates of a stop threshold.

    Parameters
    ----------
    probability : (N,) float tensor
        Estimated probability of being at the goal.
    moves : (N,) tensor
        Moves to the goal, 0 at the goal.
    threshold : float
        Probability at and above which the agent stops.

    Returns
    -------
    dict of str to float
        `miss`: share of clips at the goal where the agent does not stop. `false_alarm`: share of
        the other clips where it stops. `false_stops`: expected number of false alarms of an agent
        that hears one clip at each number of moves, from the largest that occurs down to 1. A rate
        without clips is left out.
    """
    stops, at_goal = probability >= threshold, moves == 0
    rates: dict[str, float] = {}
    if at_goal.any():
        rates["miss"] = float((~stops[at_goal]).double().mean())
    if not at_goal.all():
        rates["false_alarm"] = float(stops[~at_goal].double().mean())
        rates["false_stops"] = float((approach_weights(moves) * stops).sum())
    return rates


def approach_weights(moves: Tensor) -> Tensor:
    """Return weights (N,) that sum to 1 over the clips of each number of moves; 0 at the goal."""
    _, group, counts = moves.unique(return_inverse=True, return_counts=True)
    return torch.where(moves == 0, 0.0, 1.0 / counts[group].double())


def _approach(miss: Tensor, _: Tensor, false_stops: Tensor) -> Tensor:
    """Return the probability of no false stop on the way and a stop within `TRIES` clips there.

    False stops are rare and assumed independent: none happens with probability exp(-mean number).
    """
    return torch.exp(-false_stops) * (1 - miss**TRIES)


def _balanced(miss: Tensor, false_alarm: Tensor, _: Tensor) -> Tensor:
    """Return Youden's J ("Index for rating diagnostic tests", Cancer 3, 1950)."""
    return 1 - miss - false_alarm


# Objectives to maximise, from the rates `miss`, `false_alarm` and `false_stops`.
CRITERIA: dict[str, Callable[[Tensor, Tensor, Tensor], Tensor]] = {
    "approach": _approach,
    "balanced": _balanced,
}


def best_threshold(probability: Tensor, moves: Tensor, criterion: str) -> float:
    """Select the threshold that maximises a criterion on some clips.

    Parameters
    ----------
    probability : (N,) float tensor
        Estimated probability of being at the goal.
    moves : (N,) tensor
        Moves to the goal, 0 at the goal.
    criterion : {"approach", "balanced"}
        "approach": maximum probability of a success, where a false stop at any step ends the
        episode and a miss can be corrected at the next step. "balanced": minimum sum of `miss`
        and `false_alarm`.

    Returns
    -------
    float
        Threshold, half-way between two scores.

    Raises
    ------
    UserError
        For another criterion, or where all clips are at the goal or none is.
    """
    if criterion not in CRITERIA:
        known = ", ".join(CRITERIA)
        raise UserError(f"stop_model.criterion: '{criterion}' is none of {known}")
    at_goal = moves == 0
    if at_goal.all() or not at_goal.any():
        raise UserError("split.validation: all its clips are at the goal, or none is")
    scores, order = probability.double().sort(descending=True)
    at_goal, weights = at_goal[order].double(), approach_weights(moves)[order]
    # Rates of stopping at the k highest scores, k = 0..N.
    miss = 1 - _running(at_goal) / at_goal.sum()
    false_alarm = _running(1 - at_goal) / (1 - at_goal).sum()
    merit = CRITERIA[criterion](miss, false_alarm, _running(weights))
    ends = torch.cat((scores.new_ones(1), scores, scores.new_zeros(1)))
    # No threshold lies between equal scores.
    merit[1:-1][scores[1:] == scores[:-1]] = -torch.inf
    cut = int(merit.argmax())
    return float((ends[cut] + ends[cut + 1]) / 2)


def _running(values: Tensor) -> Tensor:
    return torch.cat((values.new_zeros(1), values.cumsum(0)))


def check_decision(criterion: str, threshold: float | None) -> None:
    """Raise `UserError` for an unknown `criterion` or a `threshold` outside 0 to 1."""
    if criterion not in CRITERIA:
        known = ", ".join(CRITERIA)
        raise UserError(f"stop_model.criterion: '{criterion}' is none of {known}")
    if threshold is not None and not 0 <= threshold <= 1:
        raise UserError(f"stop_model.threshold: {threshold}; give 0 to 1, or null to choose one")
