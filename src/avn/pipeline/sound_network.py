"""Stages of the sound network and of its source estimates for every clip."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
from omegaconf import DictConfig

from avn.acoustics.heads import head_content
from avn.core.classes import build_object, import_class
from avn.core.errors import UserError
from avn.core.hashing import digest
from avn.pipeline.apartments import TRAINING, Apartments
from avn.pipeline.audio_inference import AudioInference
from avn.pipeline.scenes import acoustics_of
from avn.pipeline.sounds import sound_categories
from avn.pipeline.stage import Stage
from avn.pipeline.trained_on_clips import TrainedOnClips

if TYPE_CHECKING:
    from lightning.pytorch.callbacks import Callback

    from avn.datamodules.sound import SoundData
    from avn.modules.sound_cnn import SoundCnn
    from avn.modules.srp_phat import SrpPhat


def has_sound_model(cfg: DictConfig) -> bool:
    """Return whether the config has a sound network."""
    return bool(cfg.sound_model.name != "none")


def hears_arrivals(cfg: DictConfig) -> bool:
    """Return whether the config's sound network has heads for how a sound arrives."""
    target = cfg.sound_model._target_
    return has_sound_model(cfg) and hasattr(import_class("sound_model", target), "arrival")


def is_trained(cfg: DictConfig) -> bool:
    """Return whether the config's sound model is a network that is trained, and no formula."""
    target = cfg.sound_model._target_
    return bool(getattr(import_class("sound_model", target), "trained", True))


def sound_network(cfg: DictConfig, apartments: Apartments) -> SoundNetwork | SoundFormula:
    """Return the stage of the sound model that hears clips of some apartments."""
    trained = not has_sound_model(cfg) or is_trained(cfg)
    return SoundNetwork(cfg) if trained else SoundFormula(cfg, apartments)


class SoundNetwork(TrainedOnClips):
    """Stage of the network that estimates the location of a source."""

    kind = "train/sound_cnn"
    node = "sound_model"
    without = "sound_model: 'none' cannot hear; choose cnn5 or released"

    def check(self) -> None:
        """Refuse a sound model without weights, besides what `TrainedOnClips` refuses."""
        if has_sound_model(self.cfg) and not is_trained(self.cfg):
            raise UserError(
                f"sound_model: '{self.cfg.sound_model.name}' has no weights, so there is nothing "
                "to train and no embedding; choose a network, such as cnn5 or arrival"
            )
        super().check()

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
            categories = list(sound_categories(self.cfg, TRAINING).values())
            return ArrivalData(acoustics_of(self.train), categories, **self.clips())
        return SoundData(**self.clips())

    def callbacks(self) -> Sequence[Callback]:
        """Return callbacks that log figures to TensorBoard."""
        from avn.reporting.sound_figures import SoundFigures

        return (SoundFigures(),)


class SoundFormula(Stage):
    """Stage of a sound model without weights: always done, and built where it is read.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.
    apartments : Apartments
        Apartments whose clips it hears.
    """

    kind = "hear/formula"

    def __init__(self, cfg: DictConfig, apartments: Apartments) -> None:
        super().__init__(cfg)
        self.apartments = apartments

    @property
    def rate(self) -> int:
        """The sampling rate of the clips, Hz."""
        return int(self.apartments.node("acoustics").rate)

    def settings(self) -> Sequence[str]:
        """Return the keys of the model and of the sampling rate."""
        return ("sound_model", f"{self.apartments.world.acoustics}.rate")

    def content(self) -> Any:
        """Return the hash of the head that the model knows; a file enters by its content."""
        head = self.cfg.sound_model.get("head")
        return None if head is None else digest(head_content(head, "sound_model.head").hex())

    def ignored(self) -> Sequence[str]:
        """Return the key of a checkpoint, which it cannot have."""
        return ("sound_model.ckpt_path",)

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return f"sound model '{self.cfg.sound_model.name}'"

    @property
    def folder(self) -> Path:
        """Folder of what is heard; it has no file of its own."""
        return Path(self.cfg.outputs) / "hear"

    def done(self) -> bool:
        """Return True."""
        return True

    def make(self) -> None:
        """Make nothing."""

    def discard(self) -> None:
        """Delete nothing."""

    def load(self) -> SrpPhat:
        """Return the model."""
        model: SrpPhat = build_object("sound_model", self.cfg.sound_model, rate=self.rate)
        return model


class HeardBySoundModel(AudioInference):
    """Base class of stages of what the sound model hears in every clip."""

    @property
    def network(self) -> SoundNetwork | SoundFormula:
        """Stage of the sound model."""
        return sound_network(self.cfg, self.apartments)

    def check(self) -> None:
        """Refuse settings of a model without weights too, which no stage makes."""
        super().check()
        if isinstance(self.network, SoundFormula):
            self.network.load()


class SourceEstimates(HeardBySoundModel):
    """Stage of the source estimates of every clip.

    The product is (K, S, sounds, realisations, 2) float32 per apartment: metres right and front.
    """

    kind = "hear/source_estimates"

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return f"source estimates by '{self.cfg.sound_model.name}' in {self.where}"
