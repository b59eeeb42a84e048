"""Stages of the sound network and of its source estimates for every clip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import torch
from omegaconf import DictConfig

from avn.core.classes import build_object, import_class
from avn.pipeline.audio_inference import AudioInference
from avn.pipeline.scenes import acoustics_of
from avn.pipeline.trained_on_clips import TrainedOnClips

if TYPE_CHECKING:
    from lightning.pytorch.callbacks import Callback

    from avn.datamodules.sound import SoundData
    from avn.modules.sound_cnn import SoundCnn


def has_sound_model(cfg: DictConfig) -> bool:
    """Return whether the config has a sound network."""
    return bool(cfg.sound_model.name != "none")


def hears_arrivals(cfg: DictConfig) -> bool:
    """Return whether the config's sound network has heads for how a sound arrives."""
    target = cfg.sound_model._target_
    return has_sound_model(cfg) and hasattr(import_class("sound_model", target), "arrival")


class SoundNetwork(TrainedOnClips):
    """Stage of the network that estimates the location of a source."""

    kind = "train/sound_cnn"
    node = "sound_model"
    without = "sound_model: 'none' cannot hear; choose cnn5 or released"

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        recipe, acoustics = self.cfg.sound_model, self.train.node("acoustics").name
        return f"sound network '{recipe.name}' ({acoustics}, train_seed {recipe.train_seed})"

    def untrained(self) -> SoundCnn:
        """Return the network with its initial weights."""
        torch.manual_seed(self.cfg.sound_model.train_seed)
        model: SoundCnn = build_object("sound_model", self.cfg.sound_model, rate=self.rate)
        return model

    def data(self) -> SoundData:
        """Return the data module of clips and source locations, or arrivals for heads."""
        from avn.datamodules.arrival import ArrivalData
        from avn.datamodules.sound import SoundData

        if hears_arrivals(self.cfg):
            return ArrivalData(acoustics_of(self.train), **self.clips())
        return SoundData(**self.clips())

    def callbacks(self) -> Sequence[Callback]:
        """Return callbacks that log figures to TensorBoard."""
        from avn.reporting.sound_figures import SoundFigures

        return (SoundFigures(),)


class SourceEstimates(AudioInference):
    """Stage of the source estimates of every clip.

    The product is (K, S, sounds, realisations, 2) float32 per apartment: metres right and front.
    """

    kind = "hear/source_estimates"

    @property
    def network(self) -> SoundNetwork:
        """Stage of the sound network."""
        return SoundNetwork(self.cfg)

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return f"source estimates by '{self.cfg.sound_model.name}' in {self.where}"
