"""Networks that are trained on clips of the training world, as stages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.settings import typed
from avn.pipeline.apartments import TRAINING
from avn.pipeline.scenes import DirectSound
from avn.pipeline.sounds import dry_sounds, sounds_content
from avn.pipeline.trained import Fitted


class TrainedOnClips(Fitted):
    """A network that listens.

    Attributes
    ----------
    node : str
        The node of the config that holds its recipe.
    without : str
        What is said where the config has none.
    """

    node: ClassVar[str]
    without: ClassVar[str]

    def check(self) -> None:
        """Refuse a config that has no such network."""
        if self.cfg[self.node].name == "none":
            raise UserError(self.without)
        super().check()

    @property
    def rate(self) -> int:
        """The sampling rate of its clips, Hz."""
        return int(self.train.node("acoustics").rate)

    def needs(self) -> Sequence[DirectSound]:
        """The sound of the training and validation apartments."""
        return (DirectSound(self.cfg, self.train), DirectSound(self.cfg, self.validation))

    def settings(self) -> Sequence[str]:
        """The recipe, and what records the clips."""
        return (self.node, TRAINING.microphone)

    def consulted(self) -> Sequence[str]:
        """The sounds, whose recordings are in the fingerprint."""
        return (TRAINING.sounds,)

    def content(self) -> Any:
        """The recordings."""
        return sounds_content(self.cfg, TRAINING)

    def seconds(self) -> float:
        """By the number of pairs and of epochs."""
        return float(4 * self.train.pairs * self.cfg[self.node].epochs / 600)

    def clips(self) -> dict[str, Any]:
        """What every data module of clips takes."""
        train, validation = (need.load() for need in self.needs())
        return {
            "train": train,
            "validation": validation,
            "sounds": dry_sounds(self.cfg, TRAINING),
            "microphone": build_object("microphone", self.train.node("microphone")),
            "recipe": typed(self.cfg[self.node]),
        }
