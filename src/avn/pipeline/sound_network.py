"""The sound network of a config, and where it takes the source of every clip to be."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig
from torch import Tensor

from avn.core.errors import UserError
from avn.core.files import stage_folder
from avn.core.hashing import digest
from avn.datamodules.sound import SoundData
from avn.dataset.scene import Scene
from avn.modules.sound_cnn import SoundCnn
from avn.pipeline import audio_inference, scenes
from avn.pipeline.per_scene import Outcome
from avn.pipeline.trained import trained
from avn.reporting.sound_figures import SoundFigures

# Raised when the code of a stage changes its result.
VERSIONS = {"sound_cnn": 1, "hear": 1}


def hears(cfg: DictConfig) -> bool:
    """Whether the config has a sound model."""
    return bool(cfg.sound_model.name != "none")


def check_hears(cfg: DictConfig) -> None:
    """Raise `UserError` where the config has no sound model."""
    if not hears(cfg):
        raise UserError("sound_model: 'none' cannot hear; choose cnn5 or released")


def model_hash(cfg: DictConfig) -> str:
    """Hash of what the sound network's weights depend on."""
    return digest(*audio_inference.training_clips_hash(cfg), cfg.sound_model, VERSIONS["sound_cnn"])


def sound_model(cfg: DictConfig, asked: bool = False) -> tuple[SoundCnn, Path]:
    """The trained sound network and its folder; trains it where it is missing.

    Parameters
    ----------
    asked : bool
        Whether it is the network that the user asked for, so that `auto=false` does not refuse it.

    Raises
    ------
    UserError
        Where the config has no sound model, or a checkpoint belongs to another config.
    """
    check_hears(cfg)
    torch.manual_seed(cfg.sound_model.train_seed)
    model: SoundCnn = instantiate(cfg.sound_model)
    folder = stage_folder(cfg.outputs, "train", "sound_cnn", model_hash(cfg))
    seed = f"train_seed {cfg.sound_model.train_seed}"
    title = f"sound network '{cfg.sound_model.name}' ({cfg.acoustics.name}, {seed})"

    def data() -> SoundData:
        return SoundData(**audio_inference.training_set(cfg), recipe=scenes.typed(cfg.sound_model))

    seconds = audio_inference.training_time(cfg, cfg.sound_model)
    figures = [SoundFigures()]
    model = trained(
        cfg, model, folder, title, data, callbacks=figures, asked=asked, seconds=seconds
    )
    return model, folder


def hear_hash(cfg: DictConfig) -> str:
    """Hash of what is heard, beside the apartment: network, sounds in their order, takes."""
    return digest(model_hash(cfg), *audio_inference.heard_clips(cfg), VERSIONS["hear"])


def hearing(cfg: DictConfig, chosen: Sequence[Scene]) -> list[Tensor]:
    """What the sound network makes of every clip of each scene, made where it is missing.

    Returns
    -------
    list of (K, S, sounds, takes, 2) float32
        Metres to the right and to the front.
    """
    check_hears(cfg)
    return audio_inference.listen(
        cfg, chosen, lambda: sound_model(cfg)[0], hearing_outcome(cfg, chosen)
    )


def hearing_outcome(cfg: DictConfig, chosen: Sequence[Scene]) -> Outcome:
    """The stage of `hearing`."""
    return Outcome(
        stage="hear",
        what="-".join(audio_inference.sound_files(cfg)),
        kind="hearing",
        dataset="estimates",
        version=VERSIONS["hear"],
        made_from=hear_hash(cfg),
        title=f"what '{cfg.sound_model.name}' hears",
        seconds=audio_inference.listening_time(cfg, chosen),
    )
