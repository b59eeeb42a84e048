"""The sound network of a config and what it hears, made where they are missing."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import torch
from hydra.utils import instantiate
from omegaconf import DictConfig
from torch import Tensor

from avn import pipeline
from avn.acoustics.clips import DrySounds, MicrophoneConfig
from avn.acoustics.dry_sounds import BUILTIN, content_hash, load_sounds
from avn.datamodules.sound import SoundData
from avn.dataset import build, scene_file
from avn.dataset.scene import Scene
from avn.errors import UserError
from avn.modules import training
from avn.modules.hearing import hear
from avn.modules.sound_cnn import SoundCnn
from avn.reporting.results import ALL_SOUNDS
from avn.stages import check_name, digest, file_hash, make_once, stage_folder, written_whole

# Raised when the code of a stage changes its result.
VERSIONS = {"sound_cnn": 1, "hear": 1}
# What networks are trained on, whatever `sound=` says.
TRAINING_SOUNDS = {name: name for name in BUILTIN}
METRICS, CHECKSUM = "metrics.json", "best.ckpt sha256"
# Draws the takes of what is heard; an episode draws among them from its own seed.
HEARING_SEED = 0
MOST_TAKES = 1000


def hears(cfg: DictConfig) -> bool:
    """Whether the config has a sound model."""
    return bool(cfg.sound_model.name != "none")


def sound_files(cfg: DictConfig) -> dict[str, str]:
    """The node `sound`: name to built-in recording or path.

    Raises
    ------
    UserError
        For a name that tables and folders need for something else.
    """
    sounds = {str(name): str(path) for name, path in cfg.sound.items()}
    for name in sounds:
        check_name("sound", name)
        if name == ALL_SOUNDS:
            raise UserError(f"sound: '{name}' is the row of all sounds; rename it")
    return sounds


def model_hash(cfg: DictConfig) -> str:
    """Hash of what the sound network's weights depend on."""
    acoustics = pipeline.acoustics_of(cfg)
    apartments = {
        part: [build.first_arrival_hash(plan, acoustics) for plan in pipeline.plans(cfg)[part]]
        for part in ("train", "validation")
    }
    sounds = content_hash(TRAINING_SOUNDS)
    return digest(apartments, sounds, cfg.microphone, cfg.sound_model, VERSIONS["sound_cnn"])


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
    if not hears(cfg):
        raise UserError("sound_model: 'none' cannot hear; choose cnn5 or released")
    torch.manual_seed(cfg.sound_model.train_seed)
    model: SoundCnn = instantiate(cfg.sound_model)
    folder = stage_folder(cfg.outputs, "train", "sound_cnn", model_hash(cfg))
    make_once(
        folder,
        f"sound network '{cfg.sound_model.name}' ({cfg.acoustics.name})",
        done=(folder / METRICS).is_file,
        make=lambda: _fit(cfg, model, folder),
        auto=cfg.auto or asked,
        estimate="a few minutes",
    )
    best = folder / training.BEST
    training.load_weights(model, best)
    if read_metrics(folder).get(CHECKSUM) != file_hash(best):
        raise UserError(f"{best}: changed since it was trained; delete {folder} to train again")
    return model, folder


def read_metrics(folder: Path) -> dict[str, Any]:
    """What a training measured; raises `UserError` where the file is damaged."""
    try:
        return dict(json.loads((folder / METRICS).read_text()))
    except (OSError, ValueError) as error:
        raise UserError(f"{folder / METRICS}: damaged; delete {folder} to train again") from error


def _fit(cfg: DictConfig, model: SoundCnn, folder: Path) -> None:
    opened = pipeline.scenes(cfg, ("train", "validation"), audible=True)
    data = SoundData(
        opened["train"],
        opened["validation"],
        cfg.acoustics.name,
        DrySounds(load_sounds(TRAINING_SOUNDS)),
        pipeline.typed(cfg.microphone),
        pipeline.typed(cfg.sound_model),
    )
    metrics = training.fit(data, model, folder)
    metrics[CHECKSUM] = file_hash(folder / training.BEST)
    with written_whole(folder / METRICS) as part:
        part.write_text(json.dumps(metrics, indent=1, sort_keys=True) + "\n")


def hear_hash(cfg: DictConfig) -> str:
    """Hash of what is heard, beside the apartment: network, sounds in their order, takes."""
    if not 1 <= cfg.takes <= MOST_TAKES:
        raise UserError(f"takes: {cfg.takes} is out of range; give 1 to {MOST_TAKES}")
    sounds = list(content_hash(sound_files(cfg)).items())
    return digest(model_hash(cfg), sounds, cfg.takes, HEARING_SEED, VERSIONS["hear"])


@dataclass(frozen=True)
class _Ears:
    """Everything that what is heard in a scene depends on."""

    model: SoundCnn
    sounds: dict[str, str]
    regime: str
    microphone: MicrophoneConfig
    takes: int


def hearing(cfg: DictConfig, chosen: Sequence[Scene]) -> list[Tensor]:
    """What the sound network makes of every clip of each scene, made where it is missing.

    Returns
    -------
    list of (K, S, sounds, takes, 2) float32
        Metres to the right and to the front.
    """
    model, _ = sound_model(cfg)
    sounds = sound_files(cfg)
    ears = _Ears(model, sounds, cfg.acoustics.name, pipeline.typed(cfg.microphone), cfg.takes)
    acoustics = pipeline.acoustics_of(cfg)
    made_from = hear_hash(cfg)
    target = stage_folder(cfg.outputs, "hear", "-".join(sounds), made_from)
    clips = sum(4 * s.grid.cells * len(s.sources) for s in chosen) * len(sounds) * cfg.takes
    hashes = [digest(made_from, build.first_arrival_hash(s.plan, acoustics)) for s in chosen]
    names = zip(chosen, hashes, strict=True)
    paths = [target / f"{which.name}-{own[:8]}.h5" for which, own in names]

    def make() -> None:
        for which, path, own in zip(chosen, paths, hashes, strict=True):
            if not path.is_file():
                _write_hearing(which, path, own, ears)

    make_once(
        target,
        f"what '{cfg.sound_model.name}' hears in {', '.join(s.name for s in chosen)}",
        done=lambda: all(path.is_file() for path in paths),
        make=make,
        auto=cfg.auto,
        estimate=f"about {max(1, clips // 800)} s",
    )
    return [_read_hearing(path, own) for path, own in zip(paths, hashes, strict=True)]


def _write_hearing(which: Scene, path: Path, made_from: str, ears: _Ears) -> None:
    sounds = DrySounds(load_sounds(ears.sounds))
    heard = hear(
        which,
        ears.regime,
        sounds,
        ears.model,
        ears.takes,
        ears.microphone,
        seed=HEARING_SEED,
    )

    def fill(file: h5py.File) -> None:
        file["estimates"] = heard.numpy()

    scene_file.write(path, "hearing", VERSIONS["hear"], made_from, fill)


def _read_hearing(path: Path, made_from: str) -> Tensor:
    with scene_file.open_checked(path, "hearing", VERSIONS["hear"], made_from) as file:
        return torch.from_numpy(file["estimates"][()])
