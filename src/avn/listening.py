"""What listens, and what it makes of every clip, made where it is missing.

Two networks listen: the sound network, which says where the source is, and the stop classifier,
which says whether it is within reach.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from torch import Tensor

from avn import pipeline
from avn.acoustics.clips import DrySounds
from avn.acoustics.dry_sounds import BUILTIN, content_hash, load_sounds
from avn.datamodules.sound import SoundData
from avn.datamodules.stop import StopData
from avn.dataset import build
from avn.dataset.scene import Scene
from avn.errors import UserError
from avn.learned import Outcome, read_metrics, trained
from avn.modules.hearing import hear
from avn.modules.listener import Listener
from avn.modules.sound_cnn import SoundCnn
from avn.modules.stop_classifier import StopClassifier, check_decision
from avn.modules.stop_metrics import CRITERIA, StopScores, best_threshold
from avn.navigation.protocols import Protocol
from avn.progress import progress_bar
from avn.reporting.results import ALL_SOUNDS
from avn.stages import check_name, digest, stage_folder

# Raised when the code of a stage changes its result.
VERSIONS = {"sound_cnn": 1, "hear": 1, "stop_classifier": 1, "stop": 1}
# What networks are trained on, whatever `sound=` says.
TRAINING_SOUNDS = {name: name for name in BUILTIN}
# Draws the takes of what is heard; an episode draws among them from its own seed.
HEARING_SEED = 0
MOST_TAKES = 1000
# How fast two cores listen, roughly, to say how long it takes.
CLIPS_PER_SECOND = 800


def hears(cfg: DictConfig) -> bool:
    """Whether the config has a sound model."""
    return bool(cfg.sound_model.name != "none")


def can_stop(cfg: DictConfig) -> bool:
    """Whether the config has a stop classifier."""
    return bool(cfg.stop_model.name != "none")


def check_hears(cfg: DictConfig) -> None:
    """Raise `UserError` where the config has no sound model."""
    if not hears(cfg):
        raise UserError("sound_model: 'none' cannot hear; choose cnn5 or released")


def _check_stops(cfg: DictConfig) -> None:
    if not can_stop(cfg):
        raise UserError("stop_model: 'none' cannot say Stop; choose cnn5")


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
    return digest(*_set_hash(cfg), cfg.sound_model, VERSIONS["sound_cnn"])


def stop_model_hash(cfg: DictConfig) -> str:
    """Hash of what the stop classifier's weights depend on; how it decides is no part of it."""
    recipe: Any = OmegaConf.to_container(cfg.stop_model, resolve=True)
    recipe = {key: recipe[key] for key in recipe if key not in ("criterion", "threshold")}
    goal = (cfg.protocol.goal, cfg.protocol.radius if cfg.protocol.goal == "radius" else None)
    return digest(*_set_hash(cfg), goal, recipe, VERSIONS["stop_classifier"])


def _set_hash(cfg: DictConfig) -> tuple[Any, ...]:
    """What every network that listens is trained on, for its hash."""
    acoustics = pipeline.acoustics_of(cfg)
    apartments = {
        part: [build.first_arrival_hash(plan, acoustics) for plan in pipeline.plans(cfg)[part]]
        for part in ("train", "validation")
    }
    return apartments, content_hash(TRAINING_SOUNDS), cfg.microphone


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
        return SoundData(**_training_set(cfg), recipe=pipeline.typed(cfg.sound_model))

    seconds = _time(cfg, cfg.sound_model)
    return trained(cfg, model, folder, title, data, asked=asked, seconds=seconds), folder


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
            **_training_set(cfg),
            recipe=pipeline.typed(cfg.stop_model),
            goal=lambda scene: protocol.goal_cells(scene.grid, scene.sources),
        )

    seconds = _time(cfg, cfg.stop_model)
    return trained(cfg, model, folder, title, data, _stop_figures, asked, seconds), folder


def _time(cfg: DictConfig, recipe: DictConfig) -> float:
    """Seconds that training takes on two cores, roughly."""
    return float(4 * pipeline.pairs(cfg, "train")[0] * recipe.epochs / 600)


def _training_set(cfg: DictConfig) -> dict[str, Any]:
    """What every network that listens is trained on, for its data module."""
    return {
        **pipeline.scenes(cfg, ("train", "validation"), audible=True),
        "regime": cfg.acoustics.name,
        "sounds": DrySounds(load_sounds(TRAINING_SOUNDS)),
        "microphone": pipeline.typed(cfg.microphone),
    }


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


def hear_hash(cfg: DictConfig) -> str:
    """Hash of what is heard, beside the apartment: network, sounds in their order, takes."""
    return digest(model_hash(cfg), *_heard_clips(cfg), VERSIONS["hear"])


def stop_hash(cfg: DictConfig) -> str:
    """Hash of the stop classifier's scores, beside the apartment; as `hear_hash`."""
    return digest(stop_model_hash(cfg), *_heard_clips(cfg), VERSIONS["stop"])


def _heard_clips(cfg: DictConfig) -> tuple[Any, ...]:
    """Which clips are listened to, for a hash."""
    if not 1 <= cfg.takes <= MOST_TAKES:
        raise UserError(f"takes: {cfg.takes} is out of range; give 1 to {MOST_TAKES}")
    return list(content_hash(sound_files(cfg)).items()), cfg.takes, HEARING_SEED


def hearing(cfg: DictConfig, chosen: Sequence[Scene]) -> list[Tensor]:
    """What the sound network makes of every clip of each scene, made where it is missing.

    Returns
    -------
    list of (K, S, sounds, takes, 2) float32
        Metres to the right and to the front.
    """
    check_hears(cfg)
    return _listen(cfg, chosen, lambda: sound_model(cfg)[0], hearing_outcome(cfg, chosen))


def hearing_outcome(cfg: DictConfig, chosen: Sequence[Scene]) -> Outcome:
    """The stage of `hearing`."""
    return Outcome(
        stage="hear",
        what="-".join(sound_files(cfg)),
        kind="hearing",
        dataset="estimates",
        version=VERSIONS["hear"],
        made_from=hear_hash(cfg),
        title=f"what '{cfg.sound_model.name}' hears",
        seconds=_listening_time(cfg, chosen),
    )


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
        what="-".join(sound_files(cfg)),
        kind="stop",
        dataset="probabilities",
        version=VERSIONS["stop"],
        made_from=stop_hash(cfg),
        title=f"where stop classifier '{cfg.stop_model.name}' would stop",
        seconds=_listening_time(cfg, chosen),
    )
    return _listen(cfg, chosen, lambda: stop_model(cfg)[0], outcome)


def _listening_time(cfg: DictConfig, chosen: Sequence[Scene]) -> float:
    clips = sum(4 * s.grid.cells * len(s.sources) for s in chosen) * len(cfg.sound) * cfg.takes
    return clips / CLIPS_PER_SECOND


def _listen(
    cfg: DictConfig, chosen: Sequence[Scene], open_model: Callable[[], Listener], outcome: Outcome
) -> list[Tensor]:
    acoustics = pipeline.acoustics_of(cfg)
    model = cache(open_model)

    def listen(scene: Scene) -> Tensor:
        return hear(
            scene,
            acoustics.name,
            DrySounds(load_sounds(sound_files(cfg))),
            model(),
            cfg.takes,
            pipeline.typed(cfg.microphone),
            seed=HEARING_SEED,
        )

    apartments = [build.first_arrival_hash(scene.plan, acoustics) for scene in chosen]
    return outcome.of(cfg, chosen, apartments, listen)
