"""`python -m avn.train model=sound_cnn`: trains the parts that learn."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from avn.config.cli import command
from avn.core.errors import UserError
from avn.core.progress import tell
from avn.pipeline import audio_inference, occupancy, policy, sound_network, stop_classifier, trained

# What opens or trains each model, and how the figures begin that are printed, over all
# sounds.
MODELS: dict[str, tuple[Callable[..., tuple[Any, Path]], tuple[str, ...]]] = {
    "sound_cnn": (sound_network.sound_model, ("error_m/", "bearing_deg/")),
    "stop_classifier": (
        stop_classifier.stop_model,
        ("auc/validation", "ece/validation", "threshold/", "miss/", "false_"),
    ),
    "a3c": (policy.policy, ("best/", "untrained/", "seconds", "steps")),
    "occupancy_cnn": (occupancy.occupancy_model, ("accuracy/", "auc/", "ece/", "loss/")),
}


@command("train")
def main(cfg: DictConfig) -> Path:
    """Train the model, or open it where it is trained, and print what was measured."""
    if cfg.model.name not in MODELS:
        raise UserError(f"model.name: '{cfg.model.name}' is none of {', '.join(MODELS)}")
    open_model, begin = MODELS[cfg.model.name]
    _, folder = open_model(cfg, asked=True)
    metrics = trained.read_metrics(folder)
    for name in sorted(metrics):
        if name.startswith(begin) and name.split("/")[-1] not in audio_inference.TRAINING_SOUNDS:
            tell(f"{name}: {metrics[name]:.3g}")
    tell(str(folder))
    return folder


if __name__ == "__main__":
    sys.exit(main())
