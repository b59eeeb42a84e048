"""Metrics of stop classifiers, by sight and sound."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor
from torchmetrics import Metric
from torchmetrics.functional.classification import binary_auroc, binary_calibration_error
from torchmetrics.utilities.data import dim_zero_cat

from avn.modules.sound_metrics import ALL, SIGHTS
from avn.modules.stop_threshold import error_rates


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
