"""What `avn.train` trains, by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from avn.core.errors import UserError
from avn.pipeline import audio_inference, occupancy, policy, sound_network, stop_classifier
from avn.pipeline.trained import read_metrics

# What opens or trains each model, and how the figures begin that are shown, over all sounds.
MODELS: dict[str, tuple[Callable[..., tuple[Any, Path]], tuple[str, ...]]] = {
    "sound_cnn": (sound_network.sound_model, ("error_m/", "bearing_deg/")),
    "stop_classifier": (
        stop_classifier.stop_model,
        ("auc/validation", "ece/validation", "threshold/", "miss/", "false_"),
    ),
    "a3c": (policy.policy, ("best/", "untrained/", "seconds", "steps")),
    "occupancy_cnn": (occupancy.occupancy_model, ("accuracy/", "auc/", "ece/", "loss/")),
}


def train_model(cfg: DictConfig) -> tuple[Path, dict[str, float]]:
    """Train the model of a config, or open it where it is trained.

    Parameters
    ----------
    cfg : DictConfig
        Of `avn.train`.

    Returns
    -------
    folder : Path
        Where its checkpoints lie.
    figures : dict of str to float
        What was measured, over all sounds, by name.

    Raises
    ------
    UserError
        Where there is no such model, or an option cannot work.
    """
    if cfg.model.name not in MODELS:
        raise UserError(f"model.name: '{cfg.model.name}' is none of {', '.join(MODELS)}")
    open_model, begin = MODELS[cfg.model.name]
    _, folder = open_model(cfg, asked=True)
    metrics = read_metrics(folder)
    by_sound = audio_inference.TRAINING_SOUNDS
    return folder, {
        name: metrics[name]
        for name in sorted(metrics)
        if name.startswith(begin) and name.split("/")[-1] not in by_sound
    }
