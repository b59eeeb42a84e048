"""What was to be seen and heard at each step of a trace, for films and pages."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from omegaconf import DictConfig
from torch import Tensor

from avn.acoustics.clips import ClipRenderer, brir_spectra, fade_samples
from avn.core.classes import build_object
from avn.core.clip_id import ClipId
from avn.navigation.trace import Trace
from avn.pipeline.apartments import Apartments
from avn.pipeline.audio_inference import HEARING_SEED
from avn.pipeline.replay import Run
from avn.pipeline.scenes import DirectSound
from avn.pipeline.sounds import dry_sounds
from avn.pipeline.stage import build
from avn.pipeline.views import RenderedViews

# Clips rendered at once.
_BATCH = 64


def observed_stages(cfg: DictConfig) -> tuple[DirectSound, RenderedViews]:
    """What pictures and clips of a run are made from."""
    apartments = Apartments(cfg, cfg.subset)
    return DirectSound(cfg, apartments), RenderedViews(cfg, apartments)


class Perceived:
    """Pictures and clips of a run's apartments, made where they are missing.

    Agents that do not see or hear stand at the same places: the pictures are what they would have
    seen, and the clips what they would have heard.

    Parameters
    ----------
    run : Run
    """

    def __init__(self, run: Run) -> None:
        cfg = run.cfg
        sound, rendered = observed_stages(cfg)
        build(sound)
        build(rendered)
        self._scenes = {scene.name: scene for scene in sound.load()}
        self._views = dict(zip(self._scenes, (own.rgb for own in rendered.load()), strict=True))
        # the clips of `SourceEstimates`: same microphone, seed and purpose
        self._renderer = ClipRenderer(
            dry_sounds(cfg), build_object("microphone", cfg.microphone), HEARING_SEED, "eval"
        )

    def views(self, room: str, states: Sequence[int] | NDArray[np.int64]) -> NDArray[np.uint8]:
        """First-person views of some states of a room, (N, H, W, 3) uint8."""
        return np.stack([self._views[room][int(state)] for state in states])

    def clips(self, trace: Trace) -> Tensor:
        """What is heard at each step, (T + 1, 2, rate) float32, left and right ear."""
        brirs = self._scenes[trace.place.name].brirs
        state, realisation = torch.from_numpy(trace.state), torch.from_numpy(trace.realisation)
        parts = []
        for states, realisations in zip(
            state.split(_BATCH), realisation.split(_BATCH), strict=True
        ):
            source = torch.full_like(states, trace.source)
            sound = torch.full_like(states, trace.sound)
            spectra = brir_spectra(brirs.gather(source, states), self._renderer.sounds.rate)
            parts.append(
                self._renderer.render(spectra, ClipId(source, states, sound, realisations))
            )
        return torch.cat(parts)


def soundtrack(clips: Tensor) -> NDArray[np.float32]:
    """Clips one after the other, a second each, without a click where they meet.

    Each clip is periodic, so that it goes on for 10 ms while the next one is faded in over it.

    Parameters
    ----------
    clips : (T, 2, rate) float32 tensor

    Returns
    -------
    (rate T, 2) float32
        Left and right; one factor for all brings the peak to 0.9, so that it grows louder on the
        way to the source.
    """
    sound = clips.clone()
    rate = clips.shape[-1]
    fade = fade_samples(rate)
    rise = (torch.arange(fade) + 1) / (fade + 1)
    begun = clips[1:, :, :fade] * rise
    sound[1:, :, :fade] = begun + clips[:-1, :, :fade] * (1 - rise)
    track = sound.permute(0, 2, 1).reshape(len(clips) * rate, 2)
    scaled: NDArray[np.float32] = (track * (0.9 / track.abs().max().clamp_min(1e-9))).numpy()
    return scaled
