"""Precomputed observations of an apartment: one tensor for each observation, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from torch import Tensor

from avn.core.clip_id import ClipId
from avn.core.sound_mix import SoundMix


class RenderedAudio(Protocol):
    """Audio observation of an apartment that is rendered when an agent hears it.

    Attributes
    ----------
    sounds, realisations : int
        Number of sounds, and of realisations of each clip.
    """

    @property
    def sounds(self) -> int:
        """Number of sounds."""

    @property
    def realisations(self) -> int:
        """Number of realisations of each clip."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the observation of one clip."""

    def __call__(self, clip: ClipId, mix: SoundMix | None = None) -> Tensor:
        """Render N clips, (N, ...) float32; sources and states are those of the apartment."""


@dataclass(frozen=True)
class SceneObservations:
    """Observations of one apartment with K sources and S states.

    Attributes
    ----------
    audio : mapping of str to (K, S, sounds, realisations, ...) tensor
        Features or estimates of each clip.
    visual : mapping of str to (S, ...) tensor
        Features or local patches of the view of each state.
    rendered : mapping of str to RenderedAudio
        Audio observations that are too large for a tensor of all clips, such as waveforms.
    """

    audio: Mapping[str, Tensor] = field(default_factory=dict)
    visual: Mapping[str, Tensor] = field(default_factory=dict)
    rendered: Mapping[str, RenderedAudio] = field(default_factory=dict)

    @property
    def sounds(self) -> int | None:
        """Number of sounds; None without audio observations."""
        known = [heard.shape[2] for heard in self.audio.values()]
        return next(iter([*known, *(each.sounds for each in self.rendered.values())]), None)

    @property
    def realisations(self) -> int:
        """Number of realisations of each clip; 1 without audio observations."""
        known = [heard.shape[3] for heard in self.audio.values()]
        return next(iter([*known, *(each.realisations for each in self.rendered.values())]), 1)

    def check(self, sources: int, states: int, sounds: int) -> None:
        """Check the shapes of all tensors.

        Parameters
        ----------
        sources, states, sounds : int
            K, S and the number of sounds of the apartment.

        Raises
        ------
        ValueError
            If a tensor has another shape.
        """
        wanted = (sources, states, sounds)
        for name, heard in self.audio.items():
            if heard.dim() < 4 or tuple(heard.shape[:3]) != wanted:
                raise ValueError(
                    f"audio '{name}' has shape {tuple(heard.shape)}; wanted (sources, states, "
                    f"sounds, realisations, ...) with {wanted} in front"
                )
        if len({heard.shape[3] for heard in self.audio.values()}) > 1:
            raise ValueError("the audio observations differ in their number of realisations")
        for name, seen in self.visual.items():
            if len(seen) != states:
                raise ValueError(f"'{name}' has {len(seen)} rows for {states} states")
