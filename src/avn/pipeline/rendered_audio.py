"""Clips as agents hear them: waveforms and spectrograms that are rendered step by step.

A tensor of the waveforms of all clips would have gigabytes, so a clip is rendered when an agent
hears it. It is the clip that the networks hear: same microphone, seed and realisation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import torch
from omegaconf import DictConfig, OmegaConf
from torch import Tensor

from avn.acoustics.clips import ClipRenderer, brir_spectra
from avn.core.classes import build_part
from avn.core.clip_id import ClipId
from avn.core.settings import plain
from avn.core.sound_mix import SoundMix
from avn.dataset.scene import AudibleScene
from avn.modules.spectrogram import Spectrogram
from avn.pipeline.apartments import Apartments
from avn.pipeline.audio_inference import Clips, check_realisations
from avn.pipeline.scenes import heard_sound
from avn.pipeline.sounds import check_heard, dry_sounds, microphone_of, sounds_content
from avn.pipeline.stage import Stage

# Clips rendered at once, for the caches of a CPU.
_BATCH = 64

# Function from clips and the index of the sound of each to observations.
Output = Callable[[Tensor, Tensor], Tensor]


def unchanged(clips: Tensor, sound: Tensor) -> Tensor:
    """Return clips as they are; an `Output`."""
    return clips


class Waveforms(Stage):
    """Stage of the waveforms of clips. It has no file of its own: it reads those of its need.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.
    apartments : Apartments
        Apartments; sounds and microphone are those of their world.
    clips : Clips
        Clip realisations.
    """

    kind = "hear/waveforms"

    @property
    def clips_class(self) -> type[RenderedClips]:
        """Class of the renderer of an apartment."""
        return RenderedClips

    def __init__(self, cfg: DictConfig, apartments: Apartments, clips: Clips) -> None:
        super().__init__(cfg)
        self.apartments, self.clips = apartments, clips

    def needs(self) -> Sequence[Stage]:
        """Return the stage of the apartments' acoustics."""
        return (heard_sound(self.cfg, self.apartments),)

    def settings(self) -> Sequence[str]:
        """Return the keys of the microphone and of the realisations."""
        return (self.apartments.world.microphone, *self.clips.settings())

    def consulted(self) -> Sequence[str]:
        """Return the key of the sounds; the fingerprint holds their content instead."""
        return (self.apartments.world.sounds,)

    def content(self) -> Any:
        """Return the hashes of the recordings, and the use of the clips."""
        return (sounds_content(self.cfg, self.apartments.world), self.clips.purpose)

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return f"clips of {self.apartments.title} ({self.clips.purpose})"

    @property
    def folder(self) -> Path:
        """Folder of the acoustics, which are all it reads."""
        return self.needed[0].folder

    def check(self) -> None:
        """Refuse settings of the clips that cannot work."""
        check_realisations(self.cfg, self.clips)
        check_heard(self.cfg, self.apartments.world)

    def done(self) -> bool:
        """Return whether the acoustics exist."""
        return all(need.done() for need in self.needed)

    def make(self) -> None:
        """Make nothing; the acoustics are made before."""

    def output(self) -> tuple[Output, tuple[int, ...]]:
        """Return the function from clips to observations, and the shape of one observation."""
        return unchanged, (2, self._rate)

    @property
    def _rate(self) -> int:
        return int(self.apartments.node("acoustics").rate)

    def load(self) -> list[RenderedClips]:
        """Return the renderer of each apartment."""
        world = self.apartments.world
        microphone = microphone_of(self.cfg, world)
        sounds = dry_sounds(self.cfg, world)
        seed = self.clips.seed_of(self.cfg)
        renderer = ClipRenderer(sounds, microphone, seed, self.clips.purpose)
        realisations = int(OmegaConf.select(self.cfg, self.clips.realisations))
        output, shape = self.output()
        return [
            self.clips_class(scene, renderer, realisations, output, shape)
            for scene in self.needs()[0].load()
        ]


class Spectrograms(Waveforms):
    """Stage of the spectrograms of clips, those of the sound network if there is one."""

    kind = "hear/spectrograms"

    def settings(self) -> Sequence[str]:
        """Return the keys of the clips and of the spectrogram."""
        return (*super().settings(), *(("sound_model.spectrogram",) if self._config else ()))

    @property
    def _config(self) -> Any:
        return self.cfg.sound_model.get("spectrogram")

    def check(self) -> None:
        """Refuse an invalid spectrogram."""
        super().check()
        self.output()

    def output(self) -> tuple[Output, tuple[int, ...]]:
        """Return the spectrogram, and the shape (channels, bands, frames)."""
        found: Spectrogram
        if self._config:
            settings = plain(self.cfg, "sound_model.spectrogram")
            found = build_part(settings, "sound_model", rate=self._rate)
        else:
            found = Spectrogram(rate=self._rate)
        shape = found.channels, found.bands, found.frames
        return (lambda clips, sound: found(clips)), shape


class RenderedClips:
    """Renderer of the clips of one apartment; see `avn.navigation.observations.RenderedAudio`.

    Parameters
    ----------
    scene : AudibleScene
        Apartment with its impulse responses.
    renderer : ClipRenderer
        Sounds and microphone.
    realisations : int
        Number of realisations of each clip.
    output : callable
        Function from clips (N, 2, rate) and the index of the sound of each (N,) to observations
        (N, ...).
    shape : tuple of int
        Shape of one observation.
    """

    def __init__(
        self,
        scene: AudibleScene,
        renderer: ClipRenderer,
        realisations: int,
        output: Output,
        shape: tuple[int, ...],
    ) -> None:
        self._brirs, self._renderer, self._output = scene.brirs, renderer, output
        self._realisations, self._shape = realisations, shape

    @property
    def sounds(self) -> int:
        """Number of sounds."""
        return len(self._renderer.sounds)

    @property
    def realisations(self) -> int:
        """Number of realisations of each clip."""
        return self._realisations

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the observation of one clip."""
        return self._shape

    @torch.no_grad()
    def __call__(self, clip: ClipId, mix: SoundMix | None = None) -> Tensor:
        """Render N clips, (N, ...) float32."""
        return torch.cat([self._rendered(*part) for part in batches(clip, mix, _BATCH)])

    def _rendered(self, clip: ClipId, mix: SoundMix | None = None) -> Tensor:
        return self._output(self._renderer.record(self.at_ears(clip, mix), clip), clip.sound)

    def at_ears(self, clip: ClipId, mix: SoundMix | None = None) -> Tensor:
        """Return the sound at the ears, without microphones, (N, 2, rate) float32."""
        renderer, rate = self._renderer, self._renderer.sounds.rate
        place = clip.source if mix is None else torch.where(mix.place < 0, clip.source, mix.place)
        brirs = self._brirs.gather(place, clip.state)
        found = renderer.at_ears(brir_spectra(brirs, rate), clip)
        if mix is None:
            return found
        mix = mix.clipped(self.memory)
        moved = mix.place_before != mix.place
        switched = ((mix.begin > -self.memory) | (mix.end < 1) | moved).nonzero()[:, 0]
        if len(switched):
            own = ClipId(*(part[switched] for part in clip))
            begin, end = mix.begin[switched], mix.end[switched]
            begin = torch.where(moved[switched], begin.clamp(min=0), begin)
            found[switched] = renderer.between(brirs[switched], own, begin, end)
        left = moved.nonzero()[:, 0]
        if len(left):  # what is still heard of the seconds before comes from where the source was
            own = ClipId(*(part[left] for part in clip))
            brirs = self._brirs.gather(mix.place_before[left], own.state)
            ends = mix.begin[left], mix.end[left].clamp(max=0)
            found[left] += renderer.between(brirs, own, *ends)
        both = (mix.other_source >= 0).nonzero()[:, 0]
        if len(both):
            own = ClipId(*(part[both] for part in clip))
            other = own._replace(source=mix.other_source[both], sound=mix.other_sound[both])
            spectra = brir_spectra(self._brirs.gather(other.source, other.state), rate)
            found[both] += renderer.at_ears(spectra, other)
        return found

    @property
    def memory(self) -> float:
        """Whole seconds for which a sound is heard after its end."""
        return float(-(-self._brirs.samples // self._renderer.sounds.rate))


def batches(clip: ClipId, mix: SoundMix | None, size: int) -> list[tuple[ClipId, SoundMix | None]]:
    """Split clips into batches.

    Parameters
    ----------
    clip : ClipId
        Clips of N agents.
    mix : SoundMix or None
        Mix of each clip.
    size : int
        Clips in a batch.
    """
    clips = [ClipId(*parts) for parts in zip(*(p.split(size) for p in clip), strict=True)]
    if mix is None:
        return [(own, None) for own in clips]
    mixes = [SoundMix(*parts) for parts in zip(*(p.split(size) for p in mix), strict=True)]
    return [*zip(clips, mixes, strict=True)]
