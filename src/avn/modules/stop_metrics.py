"""How well what is heard tells that the goal is reached, and where to draw the line."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from torch import Tensor
from torchmetrics import Metric
from torchmetrics.functional.classification import binary_auroc, binary_calibration_error
from torchmetrics.utilities.data import dim_zero_cat

from avn.core.errors import UserError
from avn.modules.sound_metrics import ALL, SIGHTS

# Times that an agent listens at the goal before it has walked off again.
TRIES = 2


def error_rates(probability: Tensor, moves: Tensor, threshold: float) -> dict[str, float]:
    """What a threshold gets wrong.

    Parameters
    ----------
    probability : (N,) float tensor
        That the goal is reached; at `threshold` and over it, the agent stops.
    moves : (N,) tensor
        Moves to the goal, 0 at the goal.

    Returns
    -------
    dict
        `miss`: share of clips at the goal where it does not stop. `false_alarm`: share of the
        others where it does. `false_stops`: false alarms to be expected of an agent that listens
        once at each number of moves from the goal, from the farthest that occurs to 1. One that
        has no clips to be measured on is left out.
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
    """Weights (N,) whose sum is 1 over the clips of each number of moves, and 0 at the goal."""
    _, which, counts = moves.unique(return_inverse=True, return_counts=True)
    return torch.where(moves == 0, 0.0, 1.0 / counts[which].double())


def _approach(miss: Tensor, _: Tensor, false_stops: Tensor) -> Tensor:
    """Chance to arrive without a false stop and to stop there within `TRIES` clips.

    False stops are rare and taken as independent, so that none happens with exp(-their mean).
    """
    return torch.exp(-false_stops) * (1 - miss**TRIES)


def _balanced(miss: Tensor, false_alarm: Tensor, _: Tensor) -> Tensor:
    """Youden's J, "Index for rating diagnostic tests" (Cancer 3, 1950), both errors alike."""
    return 1 - miss - false_alarm


# What is to be as great as it can, of the three error rates.
CRITERIA: dict[str, Callable[[Tensor, Tensor, Tensor], Tensor]] = {
    "approach": _approach,
    "balanced": _balanced,
}


def best_threshold(probability: Tensor, moves: Tensor, criterion: str) -> float:
    """The threshold that serves a criterion best on some clips.

    Parameters
    ----------
    probability : (N,) float tensor
    moves : (N,) tensor
        Moves to the goal, 0 at the goal.
    criterion : {"approach", "balanced"}
        "approach": a false stop ends the episode, and every step of the way gives occasion to
        one, while a miss can be made good at the next step; the chance to end well is greatest.
        "balanced": the sum of miss and false alarm is least.

    Returns
    -------
    float
        Half-way between two scores, so that none lies on it.

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
    # After the k highest scores, k = 0..N.
    miss = 1 - _running(at_goal) / at_goal.sum()
    false_alarm = _running(1 - at_goal) / (1 - at_goal).sum()
    merit = CRITERIA[criterion](miss, false_alarm, _running(weights))
    ends = torch.cat((scores.new_ones(1), scores, scores.new_zeros(1)))
    # Equal scores cannot be parted.
    merit[1:-1][scores[1:] == scores[:-1]] = -torch.inf
    cut = int(merit.argmax())
    return float((ends[cut] + ends[cut + 1]) / 2)


def _running(values: Tensor) -> Tensor:
    return torch.cat((values.new_zeros(1), values.cumsum(0)))


class StopScores(Metric):
    """Area under the ROC curve and calibration, in and out of sight, by sound.

    Parameters
    ----------
    sounds : sequence of str
        Names of the sounds; `update` takes indices into it.
    """

    full_state_update = False

    def __init__(self, sounds: Sequence[str]) -> None:
        super().__init__()
        self.sounds = tuple(sounds)
        for state in ("probability", "moves", "in_sight", "sound"):
            self.add_state(state, default=[], dist_reduce_fx="cat")

    def update(self, probability: Tensor, moves: Tensor, in_sight: Tensor, sound: Tensor) -> None:
        """Take in N scores.

        Parameters
        ----------
        probability : (N,) float tensor
        moves : (N,) tensor, moves to the goal
        in_sight : (N,) bool tensor, whether the source is
        sound : (N,) int64 tensor, index into the names
        """
        self.probability.append(probability)  # type: ignore[union-attr, operator]
        self.moves.append(moves)  # type: ignore[union-attr, operator]
        self.in_sight.append(in_sight)  # type: ignore[union-attr, operator]
        self.sound.append(sound)  # type: ignore[union-attr, operator]

    def scores(self) -> tuple[Tensor, Tensor]:
        """Probabilities and moves of all that was taken in, (N,) each."""
        return dim_zero_cat(self.probability), dim_zero_cat(self.moves)  # type: ignore[arg-type]

    def groups(self) -> dict[str, Tensor]:
        """Which clips, (N,) bool, each group has, such as `in_sight/ring` or `all/all`."""
        in_sight = dim_zero_cat(self.in_sight)  # type: ignore[arg-type]
        sound = dim_zero_cat(self.sound)  # type: ignore[arg-type]
        sights = {ALL: torch.ones_like(in_sight), SIGHTS[0]: in_sight, SIGHTS[1]: ~in_sight}
        return {
            f"{sight}/{name}": seen if name == ALL else seen & (sound == index - 1)
            for sight, seen in sights.items()
            for index, name in enumerate((ALL, *self.sounds))
        }

    def compute(self) -> dict[str, Tensor]:
        """Figures by name, such as `auc/in_sight/ring`, and `ece/all/all`.

        `auc` of a group that lacks either kind of clip is left out.
        """
        probability, moves = self.scores()
        label = (moves == 0).int()
        figures = {"ece/all/all": binary_calibration_error(probability, label, n_bins=15)}
        for name, chosen in self.groups().items():
            if 0 < int(label[chosen].sum()) < int(chosen.sum()):
                figures[f"auc/{name}"] = binary_auroc(probability[chosen], label[chosen])
        return figures

    def at(self, threshold: float) -> dict[str, float]:
        """`error_rates` at a threshold by name, such as `miss/in_sight/ring`."""
        probability, moves = self.scores()
        return {
            f"{rate}/{name}": value
            for name, chosen in self.groups().items()
            for rate, value in error_rates(probability[chosen], moves[chosen], threshold).items()
        }
