"""Models of `avn.train` by name."""

from __future__ import annotations

import time

from omegaconf import DictConfig

from avn.core.errors import UserError
from avn.core.progress import format_duration, log
from avn.modules.settings import SAME_WEIGHTS, TrainerConfig
from avn.pipeline.apartments import TRAINING
from avn.pipeline.building import build
from avn.pipeline.occupancy import OccupancyNetwork
from avn.pipeline.policy import Policy
from avn.pipeline.sound_network import SoundNetwork
from avn.pipeline.sounds import sound_files
from avn.pipeline.stop_classifier import StopNetwork
from avn.pipeline.trained import Trained

# Stage of each model, and prefixes of the metrics over all sounds that are printed.
MODELS: dict[str, tuple[type[Trained], tuple[str, ...]]] = {
    "sound_cnn": (SoundNetwork, ("error_m/", "bearing_deg/")),
    "stop_classifier": (
        StopNetwork,
        ("auc/validation", "ece/validation", "threshold/", "miss/", "false_"),
    ),
    "a3c": (Policy, ("best/", "untrained/", "seconds", "steps")),
    "occupancy_cnn": (OccupancyNetwork, ("accuracy/", "auc/", "ece/", "loss/")),
}


def model_of(cfg: DictConfig) -> Trained:
    """Return the stage of the model that the config names.

    Raises
    ------
    UserError
        Where there is no such model, or the config cannot work.
    """
    if cfg.model.name not in MODELS:
        raise UserError(f"model.name: '{cfg.model.name}' is none of {', '.join(MODELS)}")
    kind = MODELS[cfg.model.name][0]
    if cfg.ckpt_path is not None:
        cfg[kind.node].ckpt_path = cfg.ckpt_path
    stage = kind(cfg)
    if not stage.done():
        stage.check()
    return stage


def try_out(stage: Trained, batches: int) -> None:
    """Train a few batches of a model and measure once, and keep nothing but what it needs.

    Parameters
    ----------
    stage : Trained
        Model to train.
    batches : int
        Batches of the training and of each measurement.
    """
    stage.check()
    for need in stage.needed:
        build(need)
    started = time.perf_counter()
    stage.trial(batches)
    took = format_duration(time.perf_counter() - started)
    log(f"{stage.title}: {batches} of its batches trained and measured in {took}; nothing is kept")


def train_model(stage: Trained) -> dict[str, float]:
    """Train a model, or read it where it is trained.

    Returns
    -------
    dict of str to float
        Metrics over all sounds, by name.

    Raises
    ------
    UserError
        Where an input is missing and `auto` is false, or the model is damaged.
    """
    if stage.done() and not stage.cfg.force and (unused := _of_training_alone(stage.cfg)):
        log(f"trained before, so without {', '.join(unused)}; give force=true to train again")
    build(stage, explicit=True)
    stage.check_weights()
    metrics, prefixes = stage.metrics(), MODELS[stage.cfg.model.name][1]
    by_sound = sound_files(stage.cfg, TRAINING)
    return {
        name: metrics[name]
        for name in sorted(metrics)
        if name.startswith(prefixes) and name.split("/")[-1] not in by_sound
    }


def _of_training_alone(cfg: DictConfig) -> list[str]:
    """Return the changed settings that act while a network is trained and change no product."""
    usual = TrainerConfig()
    keys = [f"trainer.{key}" for key in SAME_WEIGHTS if cfg.trainer[key] != getattr(usual, key)]
    return [*keys, *(["logger"] if [*cfg.logger] != ["tensorboard"] else [])]
