"""The stop classifier and how likely it takes every clip to be heard at the goal, as stages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from lightning.pytorch.callbacks import Callback
from omegaconf import DictConfig

from avn.core.classes import build_object
from avn.core.progress import progress_bar
from avn.datamodules.stop import StopData
from avn.modules.stop_classifier import StopClassifier, check_decision
from avn.modules.stop_metrics import CRITERIA, StopScores, best_threshold
from avn.navigation.protocols import Protocol
from avn.pipeline.audio_inference import AudioInference
from avn.pipeline.trained_on_clips import TrainedOnClips
from avn.reporting.stop_figures import StopFigures

# How it decides; no part of what is learned.
DECISION = ("stop_model.criterion", "stop_model.threshold")


def can_stop(cfg: DictConfig) -> bool:
    """Whether the config has a stop classifier."""
    return bool(cfg.stop_model.name != "none")


class StopNetwork(TrainedOnClips):
    """The network that says whether a source is within reach.

    The goal that it knows is that of the protocol: its 3 x 3 cells, or its radius.
    """

    kind = "train/stop_classifier"
    node = "stop_model"
    without = "stop_model: 'none' cannot say Stop; choose cnn5"

    def settings(self) -> Sequence[str]:
        """The recipe, the microphone and the goal."""
        radius = ("protocol.radius",) if self.cfg.protocol.goal == "radius" else ()
        return (*super().settings(), "protocol.goal", *radius)

    def ignored(self) -> Sequence[str]:
        """How it decides."""
        return DECISION

    @property
    def title(self) -> str:
        """What it is."""
        recipe, acoustics = self.cfg.stop_model, self.train.node("acoustics").name
        settings = f"{acoustics}, {self.cfg.protocol.goal}, train_seed {recipe.train_seed}"
        return f"stop classifier '{recipe.name}' ({settings})"

    def untrained(self) -> StopClassifier:
        """The network before training."""
        model: StopClassifier = build_object("stop_model", self.cfg.stop_model, rate=self.rate)
        return model

    def data(self) -> StopData:
        """Clips and how many moves the goal is away."""
        protocol: Protocol = build_object("protocol", self.cfg.protocol)
        return StopData(
            **self.clips(), goal=lambda scene: protocol.goal_cells(scene.grid, scene.sources)
        )

    def callbacks(self) -> Sequence[Callback]:
        """What shows figures in TensorBoard."""
        return (StopFigures(),)

    def measure(self, model: StopClassifier, data: StopData) -> dict[str, Any]:
        """Thresholds and error rates over one take of every clip of the validation apartments."""
        clips = data.measured_clips["validation"]
        scores, what = StopScores(data.sounds.names), "choosing a threshold"
        with torch.inference_mode(), progress_bar(what, len(clips), "clips") as done:
            for batch in data.loader(clips, list(range(len(clips)))):
                said = torch.sigmoid(model.log_odds(batch["pictures"].to(model.device))).cpu()
                scores.update(said, batch["target"], batch["in_sight"], batch["sound"])
                done(len(said))
        figures: dict[str, Any] = {}
        for name, value in scores.compute().items():
            kind, group = name.split("/", 1)
            figures[f"{kind}/validation/{group}"] = float(value)
        for criterion in CRITERIA:
            threshold = best_threshold(*scores.scores(), criterion)
            figures[f"threshold/{criterion}"] = threshold
            for name, rate in scores.at(threshold).items():
                kind, group = name.split("/", 1)
                figures[f"{kind}/{criterion}/{group}"] = rate
        return figures

    def threshold(self) -> float:
        """The probability from which on the agent stops: the config's, or the one chosen.

        Raises
        ------
        UserError
            Where `stop_model.threshold` or `stop_model.criterion` cannot work.
        """
        recipe = self.cfg.stop_model
        check_decision(recipe.criterion, recipe.threshold)
        if recipe.threshold is not None:
            return float(recipe.threshold)
        return float(self.metrics()[f"threshold/{recipe.criterion}"])


class StopProbabilities(AudioInference):
    """How likely every clip is heard at the goal.

    Its product is (K, S, sounds, takes) float32 for each apartment; the takes are those of
    `SourceEstimates`.
    """

    kind = "hear/stop_probabilities"

    @property
    def network(self) -> StopNetwork:
        """The stop classifier."""
        return StopNetwork(self.cfg)

    @property
    def title(self) -> str:
        """What it is."""
        return f"stop probabilities by '{self.cfg.stop_model.name}' in {self.apartments.title}"
