"""Base class of stages of networks that are trained on clips of the training world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from avn.core.errors import UserError
from avn.core.settings import typed
from avn.pipeline.apartments import TRAINING
from avn.pipeline.fitted import Fitted
from avn.pipeline.scenes import DirectSound
from avn.pipeline.sounds import (
    check_heard,
    dry_sounds,
    microphone_of,
    sound_files,
    sounds_content,
)

# Clips that two cores train on in a second.
CLIPS_PER_SECOND = 1000


class TrainedOnClips(Fitted):
    """Stage of a network that is trained on binaural clips.

    Attributes
    ----------
    without : str
        Message for a config without such a network.
    """

    without: ClassVar[str]

    def check(self) -> None:
        """Refuse a config without such a network, an invalid recipe and unreadable recordings."""
        if self.cfg[self.node].name == "none":
            raise UserError(self.without)
        super().check()
        check_heard(self.cfg, TRAINING)  # a bad file is refused before anything is made

    @property
    def rate(self) -> int:
        """The sampling rate of its clips, Hz."""
        return int(self.train.node("acoustics").rate)

    def needs(self) -> Sequence[DirectSound]:
        """Return the stages of the acoustics of the training and validation apartments."""
        return (DirectSound(self.cfg, self.train), DirectSound(self.cfg, self.validation))

    def settings(self) -> Sequence[str]:
        """Return the keys of the recipe and the microphone."""
        return (self.node, TRAINING.microphone)

    def consulted(self) -> Sequence[str]:
        """Return the key of the sounds; the fingerprint holds their recordings instead."""
        return (TRAINING.sounds,)

    def content(self) -> Any:
        """Return the hashes of the recordings."""
        return sounds_content(self.cfg, TRAINING)

    def seconds(self) -> float:
        """Estimate the duration from the clips of an epoch, trained on and measured."""
        recipe, sounds = self.cfg[self.node], len(sound_files(self.cfg, TRAINING))
        clips = [4 * apartments.pairs * sounds for apartments in (self.train, self.validation)]
        measured = sum(self.in_epoch(min(count, recipe.validation_clips)) for count in clips)
        trained = self.in_epoch(4 * self.train.pairs * recipe.sounds_per_pair)
        return float(self.epochs * (trained + measured) / CLIPS_PER_SECOND)

    def clips(self) -> dict[str, Any]:
        """Return the common arguments of data modules of clips."""
        train, validation = (need.load() for need in self.needs())
        return {
            "train": train,
            "validation": validation,
            "sounds": dry_sounds(self.cfg, TRAINING),
            "microphone": microphone_of(self.cfg, TRAINING),
            "recipe": typed(self.cfg[self.node]),
        }
