"""Stop classifier: probability that the agent is at the goal, from one clip."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torchmetrics import MeanMetric

from avn.core.errors import UserError
from avn.modules.audio_network import FIVE_LAYERS, AudioNetwork, PictureBatch
from avn.modules.network import SUBSETS, Part
from avn.modules.stop_metrics import StopScores
from avn.modules.stop_threshold import check_decision

ONE_SCORE: Part = {**FIVE_LAYERS, "output_scale": 1.0}


class StopClassifier(AudioNetwork):
    """Binary classifier of clips: at the goal or not.

    The goal has few of all cells, so clips at the goal are oversampled in training. The log-odds
    are shifted by the difference of the two priors (King and Zeng, "Logistic regression in rare
    events data", Political Analysis 9, 2001): probabilities are those of a state that is drawn
    uniformly from all states of the training apartments.

    Parameters
    ----------
    net : dict
        Config of the network on the spectrogram, with `_target_`.
    epochs : int
        Maximum number of epochs, 1 or more.
    positives : float
        Share of training clips at the goal, more than 0 and less than 1.
    criterion : {"approach", "balanced"}
        Criterion that selects the threshold on the validation apartments; see
        `avn.modules.stop_threshold.best_threshold`. The network does not depend on it.
    threshold : float or None
        Probability at and above which the agent stops, 0 to 1; null selects it by `criterion`.
    **recipe
        Those of `avn.modules.audio_network.AudioNetwork`.
    """

    log_odds_shift: Tensor
    node = "stop_model"
    what = "stop classifier"
    monitor = "loss/validation"
    # The distance to the goal is the same with the ears exchanged.
    mirror_signs = (1.0,)

    def __init__(
        self,
        net: Part = ONE_SCORE,
        epochs: int = 7,
        positives: float = 0.25,
        criterion: str = "approach",
        threshold: float | None = None,
        **recipe: Any,
    ) -> None:
        super().__init__(net=net, epochs=epochs, **recipe)
        if not 0 < positives < 1:
            raise UserError(f"stop_model.positives is {positives}; give more than 0, less than 1")
        check_decision(criterion, threshold)
        self.register_buffer("log_odds_shift", torch.zeros(()))
        self.training_loss = MeanMetric()
        # In plain lists metrics stay on the CPU and out of checkpoints.
        self.losses = [MeanMetric() for _ in SUBSETS]
        self.scores: list[StopScores] = []

    def forward(self, clips: Tensor) -> Tensor:
        """Estimate the probability of being at the goal for N clips.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor
            Waveforms of the left and the right ear.

        Returns
        -------
        (N,) float32 tensor
            Probabilities.
        """
        return torch.sigmoid(self.log_odds(self.spectrogram(clips)))

    def log_odds(self, pictures: Tensor) -> Tensor:
        """Map spectrograms (N, channels, bands, frames) to prior-corrected log-odds (N,)."""
        return self.estimate(pictures)[:, 0] + self.log_odds_shift

    def prepare(self, data: Any) -> None:
        """Set the names of the sounds and the prior correction from the data module."""
        super().prepare(data)
        shift = _log_odds(data.prior) - _log_odds(self.hparams["positives"])
        self.log_odds_shift.fill_(shift)

    def name_sounds(self, sounds: Sequence[str]) -> None:
        """Set the names of the sounds, by index; metrics are grouped by them."""
        self.scores = [StopScores(sounds) for _ in SUBSETS]

    def training_step(self, batch: PictureBatch, index: int) -> Tensor:
        """Return the cross-entropy, after flip augmentation."""
        at_goal = (batch["target"] == 0).float()[:, None]
        pictures, at_goal = self.random_flip(batch["pictures"], at_goal)
        loss = nn.functional.binary_cross_entropy_with_logits(self._net(pictures), at_goal)
        self.training_loss.update(loss.detach(), len(at_goal))
        return loss

    def on_train_epoch_end(self) -> None:
        """Log the mean training loss of the epoch (with dropout and oversampled goals)."""
        self.log("loss/steps", self.training_loss.compute() * 1.0)
        self.training_loss.reset()

    def validation_step(self, batch: PictureBatch, index: int, dataloader_idx: int = 0) -> None:
        """Add one batch to the metrics of a subset.

        Parameters
        ----------
        batch : PictureBatch
            Spectrograms with moves to the goal.
        index : int
            Number of the batch; unused.
        dataloader_idx : int
            Index into `SUBSETS`.
        """
        log_odds, moves = self.log_odds(batch["pictures"]).cpu(), batch["target"].cpu()
        at_goal = (moves == 0).float()
        loss = nn.functional.binary_cross_entropy_with_logits(log_odds, at_goal)
        self.losses[dataloader_idx].update(loss, len(moves))
        in_sight, sound = batch["in_sight"].cpu(), batch["sound"].cpu()
        self.scores[dataloader_idx].update(torch.sigmoid(log_odds), moves, in_sight, sound)

    def on_validation_epoch_end(self) -> None:
        """Log losses and metrics such as `auc/validation/in_sight/ring`."""
        for subset, loss, scores in zip(SUBSETS, self.losses, self.scores, strict=True):
            values = {f"loss/{subset}": loss.compute()}
            for name, value in scores.compute().items():
                kind, group = name.split("/", 1)
                values[f"{kind}/{subset}/{group}"] = value
            loss.reset()
            scores.reset()
            self.keep(values)


def _log_odds(probability: float) -> float:
    return math.log(probability / (1 - probability))
