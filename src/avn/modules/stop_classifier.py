"""The stop classifier: whether the source of a sound is within reach."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import torch
from torch import Tensor, nn
from torchmetrics import MeanMetric

from avn.core.errors import UserError
from avn.modules.five_layer_cnn import NetConfig
from avn.modules.listener import Listener, PictureBatch
from avn.modules.network import SPLITS
from avn.modules.sound_cnn import SoundModelConfig
from avn.modules.stop_metrics import CRITERIA, StopScores


@dataclass
class StopModelConfig(SoundModelConfig):
    """What says Stop, with the recipe that trains it: one node of the config, `stop_model`."""

    _target_: str = "avn.modules.stop_classifier.StopClassifier"
    net: NetConfig = field(default_factory=lambda: NetConfig(reach=1.0))
    epochs: int = 7
    validation_clips: int = 2000
    positives: float = 0.25
    criterion: str = "approach"
    threshold: float | None = None


class StopClassifier(Listener):
    """Spectrogram, network with one output and the recipe that trains them.

    The goal is a few cells of many, so clips at the goal are shown more often in training than
    they are met, and the log-odds are put right by the difference of the two priors (King and
    Zeng, "Logistic regression in rare events data", Political Analysis 9, 2001): probabilities
    are those of a state drawn from all states of the training apartments alike.

    Parameters
    ----------
    name, spectrogram, net, optimizer, schedule, epochs, patience, batch, mirror, symmetric, \
train_seed, sounds_per_pair, validation_clips
        As those of `avn.modules.sound_cnn.SoundCnn`.
    positives : float
        Share of training clips at the goal.
    criterion, threshold : str, float or None
        How the threshold is chosen on the validation apartments, or the threshold itself; no part
        of the recipe, for the network is the same.
    """

    log_odds_shift: Tensor
    node = "stop_model"
    what = "stop classifier"
    monitor = "loss/validation"
    # The goal is as near when the ears are exchanged.
    mirror_signs = (1.0,)

    def __init__(
        self,
        name: str,
        spectrogram: dict[str, Any],
        net: dict[str, Any],
        optimizer: dict[str, Any],
        schedule: str = "cosine",
        epochs: int = 7,
        patience: int = 6,
        batch: int = 64,
        mirror: bool = True,
        symmetric: bool = True,
        train_seed: int = 0,
        sounds_per_pair: int = 1,
        validation_clips: int = 2000,
        positives: float = 0.25,
        criterion: str = "approach",
        threshold: float | None = None,
    ) -> None:
        super().__init__()
        self.save_hyperparameters(ignore=["criterion", "threshold"])
        if not 0 < positives < 1:
            raise UserError(f"stop_model.positives is {positives}; give more than 0, less than 1")
        check_decision(criterion, threshold)
        self.build_ears()
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
        pictures, at_goal = self.half_mirrored(batch["pictures"], at_goal)
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


def no_stop_model(**_: Any) -> None:
    """What the option `none` of the group builds: nothing, so that no agent has it."""


def _log_odds(probability: float) -> float:
    return math.log(probability / (1 - probability))
