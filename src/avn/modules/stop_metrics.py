"""Metrics of stop classifiers, and selection of the stop threshold."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from torch import Tensor
from torchmetrics import Metric
from torchmetrics.functional.classification import binary_auroc, binary_calibration_error
from torchmetrics.utilities.data import dim_zero_cat

from avn.core.errors import UserError
from avn.modules.sound_metrics import ALL, SIGHTS

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


class StopScores(Metric):
    """ROC AUC and calibration error of stop probabilities, by sight and sound.

    Parameters
    ----------
    sounds : sequence of str
        Names of the sounds, by index.
    """

    full_state_update = False

    def __init__(self, sounds: Sequence[str]) -> None:
        super().__init__()
        self.sounds = tuple(sounds)
        for state in ("probability", "moves", "in_sight", "sound"):
            self.add_state(state, default=[], dist_reduce_fx="cat")

    def update(self, probability: Tensor, moves: Tensor, in_sight: Tensor, sound: Tensor) -> None:
        """Add N estimates.

        Parameters
        ----------
        probability : (N,) float tensor
            Estimated probability of being at the goal.
        moves : (N,) tensor
            Moves to the goal, 0 at the goal.
        in_sight : (N,) bool tensor
            Whether the source is in the line of sight.
        sound : (N,) int64 tensor
            Index of the sound.
        """
        self.probability.append(probability)  # type: ignore[union-attr, operator]
        self.moves.append(moves)  # type: ignore[union-attr, operator]
        self.in_sight.append(in_sight)  # type: ignore[union-attr, operator]
        self.sound.append(sound)  # type: ignore[union-attr, operator]

    def scores(self) -> tuple[Tensor, Tensor]:
        """Return all probabilities and moves that were added, (N,) each."""
        return dim_zero_cat(self.probability), dim_zero_cat(self.moves)  # type: ignore[arg-type]

    def groups(self) -> dict[str, Tensor]:
        """Return the mask (N,) of each group's clips, such as `in_sight/ring` or `all/all`."""
        in_sight = dim_zero_cat(self.in_sight)  # type: ignore[arg-type]
        sound = dim_zero_cat(self.sound)  # type: ignore[arg-type]
        sights = {ALL: torch.ones_like(in_sight), SIGHTS[0]: in_sight, SIGHTS[1]: ~in_sight}
        return {
            f"{sight}/{name}": seen if name == ALL else seen & (sound == index - 1)
            for sight, seen in sights.items()
            for index, name in enumerate((ALL, *self.sounds))
        }

    def compute(self) -> dict[str, Tensor]:
        """Return metrics by name: `auc/in_sight/ring` and the like, and `ece/all/all`.

        The AUC of a group with one class of clips only is left out.
        """
        probability, moves = self.scores()
        label = (moves == 0).int()
        metrics = {"ece/all/all": binary_calibration_error(probability, label, n_bins=15)}
        for name, group in self.groups().items():
            if 0 < int(label[group].sum()) < int(group.sum()):
                metrics[f"auc/{name}"] = binary_auroc(probability[group], label[group])
        return metrics

    def at(self, threshold: float) -> dict[str, float]:
        """Return `error_rates` at a threshold by name, such as `miss/in_sight/ring`."""
        probability, moves = self.scores()
        return {
            f"{rate}/{name}": value
            for name, group in self.groups().items()
            for rate, value in error_rates(probability[group], moves[group], threshold).items()
        }
