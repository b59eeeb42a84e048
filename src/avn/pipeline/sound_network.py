"""The sound network and where it takes the source of every clip to be, as stages."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from lightning.pytorch.callbacks import Callback
from omegaconf import DictConfig

from avn.core.classes import build_object
from avn.datamodules.sound import SoundData
from avn.modules.sound_cnn import SoundCnn
from avn.pipeline.audio_inference import AudioInference
from avn.pipeline.trained_on_clips import TrainedOnClips
from avn.reporting.sound_figures import SoundFigures


def hears(cfg: DictConfig) -> bool:
    """Whether the config has a sound model."""
    return bool(cfg.sound_model.name != "none")


class SoundNetwork(TrainedOnClips):
    """The network that says where a source is."""

    kind = "train/sound_cnn"
    node = "sound_model"
    without = "sound_model: 'none' cannot hear; choose cnn5 or released"

    @property
    def title(self) -> str:
        """What it is."""
        recipe, acoustics = self.cfg.sound_model, self.train.node("acoustics").name
        return f"sound network '{recipe.name}' ({acoustics}, train_seed {recipe.train_seed})"

    def untrained(self) -> SoundCnn:
        """The network before training."""
        torch.manual_seed(self.cfg.sound_model.train_seed)
        model: SoundCnn = build_object("sound_model", self.cfg.sound_model, rate=self.rate)
        return model

    def data(self) -> SoundData:
        """Clips and where their sources are."""
        return SoundData(**self.clips())

    def callbacks(self) -> Sequence[Callback]:
        """What shows figures in TensorBoard."""
        return (SoundFigures(),)


class SourceEstimates(AudioInference):
    """Where the sound network takes the source of every clip to be.

    Its product is (K, S, sounds, takes, 2) float32 for each apartment: metres right and front.
    """

    kind = "hear/source_estimates"

    @property
    def network(self) -> SoundNetwork:
        """The sound network."""
        return SoundNetwork(self.cfg)

    @property
    def title(self) -> str:
        """What it is."""
        return f"source estimates by '{self.cfg.sound_model.name}' in {self.apartments.title}"
