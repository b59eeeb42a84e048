"""A small sound network and its data, for tests of the training with Lightning."""

from pathlib import Path
from typing import Any

import torch
import yaml
from lightning.pytorch.loggers import Logger
from omegaconf import DictConfig
from small import option
from synthetic_scene import synthetic_scene, synthetic_sounds

from avn.acoustics.microphone import Microphone
from avn.config.folder import conf_folder
from avn.core.classes import build_object
from avn.core.settings import typed
from avn.datamodules.sound import SoundData
from avn.modules.attachments import build_loggers
from avn.modules.sound_cnn import SoundCnn


def recipe(**changes: Any) -> DictConfig:
    config = option("sound_model", "cnn5", epochs=4, batch=16, validation_clips=60)
    config.optimizer.lr, config.net.dropout = 3e-3, 0.1
    config.spectrogram.bands = config.spectrogram.frames = 16
    config.net.widths, config.net.hidden = [8, 8, 8, 8, 8], [16]
    for key, value in changes.items():
        setattr(config, key, value)
    return config


def build(rate: int = 16000, **changes: Any) -> tuple[SoundData, SoundCnn]:
    config = recipe(**changes)
    scenes = [synthetic_scene("a", rate=rate)], [synthetic_scene("b", 2.5, rate)]
    data = SoundData(*scenes, synthetic_sounds(rate), Microphone(), typed(config))
    return data, build_object("sound_model", config, rate=rate)


def weights(path: Path) -> dict[str, torch.Tensor]:
    return torch.load(path, weights_only=True)["state_dict"]


def nodes(group: str, *names: str) -> dict[str, Any]:
    """Return the content of several options of a group."""
    found: dict[str, Any] = {}
    for name in names:
        found |= yaml.safe_load((conf_folder() / group / f"{name}.yaml").read_text())
    return found


def loggers(folder: Path, *names: str) -> list[Logger]:
    return build_loggers(nodes("logger", *names), folder, "a-run")
