"""The stop classifier: whether the source of a sound is within reach."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torchmetrics import MeanMetric

from avn.core.errors import UserError
from avn.modules.audio_network import FIVE_LAYERS, AudioNetwork, PictureBatch
from avn.modules.network import SPLITS, Part
from avn.modules.stop_metrics import CRITERIA, StopScores

ONE_SCORE: Part = {**FIVE_LAYERS, "output_scale": 1.0}


class StopClassifier(AudioNetwork):
    """Spectrogram, network with one output and the recipe that trains them.

    The goal is a few cells of many, so clips at the goal are shown more often in training than
    they are met, and the log-odds are put right by the difference of the two priors (King and
    Zeng, "Logistic regression in rare events data", Political Analysis 9, 2001): probabilities
    are those of a state drawn from all states of the training apartments alike.

    Parameters
    ----------
    net : dict
        Config of the network, with `_target_`.
    epochs : int
        Length of the training.
    positives : float
        Share of training clips at the goal.
    criterion : str
        How the threshold is chosen on the validation apartments; no part of the recipe, for the
        network is the same.
    threshold : float or None
        The threshold itself; null chooses it by the criterion.
    **recipe
        Those of `avn.modules.audio_network.AudioNetwork`.
    """

    log_odds_shift: Tensor
    node = "stop_model"
    what = "stop classifier"
    monitor = "loss/validation"
    # The goal is as near when the ears are exchanged.
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
        # Plain lists: they take what is already on the CPU and are no part of a checkpoint.
        self.losses = [MeanMetric() for _ in SPLITS]
        self.scores: list[StopScores] = []

    def forward(self, clips: Tensor) -> Tensor:
        """How likely the source is within reach.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor

        Returns
        -------
        (N,) float32 tensor
            Probability.
        """
        return torch.sigmoid(self.log_odds(self.spectrogram(clips)))

    def log_odds(self, pictures: Tensor) -> Tensor:
        """(N, channels, bands, frames) pictures to (N,), put right for the prior."""
        return self.estimate(pictures)[:, 0] + self.log_odds_shift

    def prepare(self, data: Any) -> None:
        """Take the sounds' names, and how seldom a state is at the goal."""
        super().prepare(data)
        shown = self.hparams["positives"]
        shift = _log_odds(data.prior) - _log_odds(shown)
        self.log_odds_shift.fill_(shift)

    def name_sounds(self, sounds: Sequence[str]) -> None:
        """Say what the sounds of the batches are called; the metrics are by these names."""
        self.scores = [StopScores(sounds) for _ in SPLITS]

    def training_step(self, batch: PictureBatch, index: int) -> Tensor:
        """The cross-entropy, with half of the clips mirrored."""
        at_goal = (batch["target"] == 0).float()[:, None]
        pictures, at_goal = self.random_flip(batch["pictures"], at_goal)
        loss = nn.functional.binary_cross_entropy_with_logits(self._net(pictures), at_goal)
        self.training_loss.update(loss.detach(), len(at_goal))
        return loss

    def on_train_epoch_end(self) -> None:
        """Log the loss that the epoch's steps saw (with dropout, the goal shown often)."""
        self.log("loss/steps", self.training_loss.compute() * 1.0)
        self.training_loss.reset()

    def validation_step(self, batch: PictureBatch, index: int, dataloader_idx: int = 0) -> None:
        """Take in the scores of one batch of one of `SPLITS`."""
        log_odds, moves = self.log_odds(batch["pictures"]).cpu(), batch["target"].cpu()
        at_goal = (moves == 0).float()
        loss = nn.functional.binary_cross_entropy_with_logits(log_odds, at_goal)
        self.losses[dataloader_idx].update(loss, len(moves))
        in_sight, sound = batch["in_sight"].cpu(), batch["sound"].cpu()
        self.scores[dataloader_idx].update(torch.sigmoid(log_odds), moves, in_sight, sound)

    def on_validation_epoch_end(self) -> None:
        """Log losses and figures such as `auc/validation/in_sight/ring`."""
        for split, loss, scores in zip(SPLITS, self.losses, self.scores, strict=True):
            values = {f"loss/{split}": loss.compute()}
            for name, value in scores.compute().items():
                kind, group = name.split("/", 1)
                values[f"{kind}/{split}/{group}"] = value
            loss.reset()
            scores.reset()
            self.keep(values)


def check_decision(criterion: str, threshold: float | None) -> None:
    """Raise `UserError` where the node's `criterion` or `threshold` cannot work."""
    if criterion not in CRITERIA:
        known = ", ".join(CRITERIA)
        raise UserError(f"stop_model.criterion: '{criterion}' is none of {known}")
    if threshold is not None and not 0 <= threshold <= 1:
        raise UserError(f"stop_model.threshold: {threshold}; give 0 to 1, or null to choose one")


def _log_odds(probability: float) -> float:
    return math.log(probability / (1 - probability))
