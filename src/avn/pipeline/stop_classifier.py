"""The stop classifier of a config, and how likely it takes every clip to be heard at the goal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from torch import Tensor

from avn.core.errors import UserError
from avn.core.files import stage_folder
from avn.core.hashing import digest
from avn.core.progress import progress_bar
from avn.datamodules.stop import StopData
from avn.dataset.scene import Scene
from avn.modules.stop_classifier import StopClassifier, check_decision
from avn.modules.stop_metrics import CRITERIA, StopScores, best_threshold
from avn.navigation.protocols import Protocol
from avn.pipeline import audio_inference, scenes
from avn.pipeline.per_scene import Outcome
from avn.pipeline.trained import read_metrics, trained
from avn.reporting.stop_figures import StopFigures

# Raised when the code of a stage changes its result.
VERSIONS = {"stop_classifier": 1, "stop": 1}


def can_stop(cfg: DictConfig) -> bool:
    """Whether the config has a stop classifier."""
    return bool(cfg.stop_model.name != "none")


def _check_stops(cfg: DictConfig) -> None:
    if not can_stop(cfg):
        raise UserError("stop_model: 'none' cannot say Stop; choose cnn5")


def stop_model_hash(cfg: DictConfig) -> str:
    """Hash of what the stop classifier's weights depend on; how it decides is no part of it."""
    recipe: Any = OmegaConf.to_container(cfg.stop_model, resolve=True)
    recipe = {key: recipe[key] for key in recipe if key not in ("criterion", "threshold")}
    goal = (cfg.protocol.goal, cfg.protocol.radius if cfg.protocol.goal == "radius" else None)
    return digest(
        *audio_inference.training_clips_hash(cfg), goal, recipe, VERSIONS["stop_classifier"]
    )


def stop_model(cfg: DictConfig, asked: bool = False) -> tuple[StopClassifier, Path]:
    """The trained stop classifier and its folder; as `sound_model`.

    The goal that it knows is that of the protocol: its 3 x 3 cells, or its radius.
    """
    _check_stops(cfg)
    protocol: Protocol = instantiate(cfg.protocol)
    model: StopClassifier = instantiate(cfg.stop_model)
    folder = stage_folder(cfg.outputs, "train", "stop_classifier", stop_model_hash(cfg))
    settings = f"{cfg.acoustics.name}, {protocol.goal}, train_seed {cfg.stop_model.train_seed}"
    title = f"stop classifier '{cfg.stop_model.name}' ({settings})"

    def data() -> StopData:
        return StopData(
            **audio_inference.training_set(cfg),
            recipe=scenes.typed(cfg.stop_model),
            goal=lambda scene: protocol.goal_cells(scene.grid, scene.sources),
        )

    seconds = audio_inference.training_time(cfg, cfg.stop_model)
    figures = [StopFigures()]
    model = trained(cfg, model, folder, title, data, _stop_figures, figures, asked, seconds)
    return model, folder


def _stop_figures(model: StopClassifier, data: StopData) -> dict[str, Any]:
    """Thresholds and error rates over one take of every clip of the validation apartments."""
    clips = data.measured_clips["validation"]
    scores = StopScores(data.sounds.names)
    with torch.inference_mode(), progress_bar("choosing a threshold", len(clips), "clips") as done:
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


def stop_threshold(cfg: DictConfig) -> float:
    """The probability from which on the agent stops: the config's, or the one that was chosen.

    Raises
    ------
    UserError
        Where `stop_model.threshold` or `stop_model.criterion` cannot work.
    """
    check_decision(cfg.stop_model.criterion, cfg.stop_model.threshold)
    if cfg.stop_model.threshold is not None:
        return float(cfg.stop_model.threshold)
    _, folder = stop_model(cfg)
    return float(read_metrics(folder)[f"threshold/{cfg.stop_model.criterion}"])


def stop_hash(cfg: DictConfig) -> str:
    """Hash of the stop classifier's scores, beside the apartment; as `hear_hash`."""
    return digest(stop_model_hash(cfg), *audio_inference.heard_clips(cfg), VERSIONS["stop"])


def stop_scores(cfg: DictConfig, chosen: Sequence[Scene]) -> list[Tensor]:
    """How likely every clip of each scene is heard at the goal, made where it is missing.

    The takes are those of `hearing`.

    Returns
    -------
    list of (K, S, sounds, takes) float32
        Probability that the source is within reach.
    """
    _check_stops(cfg)
    outcome = Outcome(
        stage="stop",
        what="-".join(audio_inference.sound_files(cfg)),
        kind="stop",
        dataset="probabilities",
        version=VERSIONS["stop"],
        made_from=stop_hash(cfg),
        title=f"where stop classifier '{cfg.stop_model.name}' would stop",
        seconds=audio_inference.listening_time(cfg, chosen),
    )
    return audio_inference.listen(cfg, chosen, lambda: stop_model(cfg)[0], outcome)
