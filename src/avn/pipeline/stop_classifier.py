"""Stages of the stop classifier and of its probabilities for every clip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import torch
from omegaconf import DictConfig

from avn.core.classes import build_object
from avn.core.progress import progress_bar
from avn.modules.stop_threshold import CRITERIA, best_threshold, check_decision
from avn.navigation.protocols import GOAL_MEANINGS, Protocol
from avn.pipeline.apartments import TRAINING
from avn.pipeline.audio_inference import CLIPS_PER_SECOND, AudioInference
from avn.pipeline.sounds import sound_files
from avn.pipeline.trained_on_clips import TrainedOnClips

if TYPE_CHECKING:
    from lightning.pytorch.callbacks import Callback

    from avn.datamodules.stop import StopData
    from avn.modules.stop_classifier import StopClassifier

# Keys of the decision, which the network does not depend on.
DECISION = ("stop_model.criterion", "stop_model.threshold")


def has_stop_model(cfg: DictConfig) -> bool:
    """Return whether the config has a stop classifier."""
    return bool(cfg.stop_model.name != "none")


class StopNetwork(TrainedOnClips):
    """Stage of the network that estimates whether the agent is at the goal.

    The goal is that of the protocol: 3 x 3 cells, or a radius.
    """

    kind = "train/stop_classifier"
    node = "stop_model"
    without = "stop_model: 'none' cannot say Stop; choose cnn5"

    def settings(self) -> Sequence[str]:
        """Return the keys of the recipe, the microphone and the goal."""
        radius = ("protocol.radius",) if self.cfg.protocol.goal == "radius" else ()
        return (*super().settings(), "protocol.goal", *radius)

    def ignored(self) -> Sequence[str]:
        """Return the keys of the decision."""
        return DECISION

    def content(self) -> Any:
        """Return the hashes of the recordings, and the meaning of the goal where it has changed."""
        return [*super().content(), *GOAL_MEANINGS.get(self.cfg.protocol.goal, ())]

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        recipe, acoustics = self.cfg.stop_model, self.train.node("acoustics").name
        settings = f"{acoustics}, {self.cfg.protocol.goal}, train_seed {recipe.train_seed}"
        return f"stop classifier '{recipe.name}' ({settings})"

    def untrained(self) -> StopClassifier:
        """Return the network with its initial weights."""
        model: StopClassifier = build_object("stop_model", self.cfg.stop_model, rate=self.rate)
        return model

    def data(self) -> StopData:
        """Return the data module of clips and moves to the goal."""
        from avn.datamodules.stop import StopData

        protocol: Protocol = build_object("protocol", self.cfg.protocol)
        return StopData(
            **self.clips(), goal=lambda scene: protocol.goal_cells(scene.grid, scene.sources)
        )

    def callbacks(self) -> Sequence[Callback]:
        """Return callbacks that log figures to TensorBoard."""
        from avn.reporting.stop_figures import StopFigures

        return (StopFigures(),)

    def seconds(self) -> float:
        """Estimate the duration of the training and of the choice of thresholds."""
        sounds = len(sound_files(self.cfg, TRAINING))
        return super().seconds() + 4 * self.validation.pairs * sounds / CLIPS_PER_SECOND

    def measure(self, model: StopClassifier, data: StopData) -> dict[str, Any]:
        """Return thresholds and error rates over one realisation of every validation clip."""
        from avn.modules.stop_metrics import StopScores

        clips = data.measured_clips["validation"]
        scores, what = StopScores(data.sounds.names), "choosing a threshold"
        with torch.inference_mode(), progress_bar(what, len(clips), "clips") as done:
            for batch in data.loader(clips, list(range(len(clips)))):
                estimate = torch.sigmoid(model.log_odds(batch["pictures"].to(model.device))).cpu()
                scores.update(estimate, batch["target"], batch["in_sight"], batch["sound"])
                done(len(estimate))
        metrics: dict[str, Any] = {}
        for name, value in scores.compute().items():
            kind, group = name.split("/", 1)
            metrics[f"{kind}/validation/{group}"] = float(value)
        for criterion in CRITERIA:
            threshold = best_threshold(*scores.scores(), criterion)
            metrics[f"threshold/{criterion}"] = threshold
            for name, rate in scores.at(threshold).items():
                kind, group = name.split("/", 1)
                metrics[f"{kind}/{criterion}/{group}"] = rate
        return metrics

    def threshold(self) -> float:
        """Return the probability at which the agent stops: set, or selected by the criterion.

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
    """Stage of the probabilities that every clip is heard at the goal.

    The product is (K, S, sounds, realisations) float32 per apartment; the clips are those of
    `SourceEstimates`.
    """

    kind = "hear/stop_probabilities"

    @property
    def network(self) -> StopNetwork:
        """Stage of the stop classifier."""
        return StopNetwork(self.cfg)

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return f"stop probabilities by '{self.cfg.stop_model.name}' in {self.where}"
