"""Views and clips at each step of a trace, for films and reports."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from omegaconf import DictConfig
from torch import Tensor

from avn.acoustics.clips import ClipRenderer, fade_samples
from avn.core.clip_id import ClipId
from avn.navigation.trace import Trace
from avn.pipeline.apartments import Apartments
from avn.pipeline.audio_inference import Clips
from avn.pipeline.building import build
from avn.pipeline.rendered_audio import RenderedClips, unchanged
from avn.pipeline.replay import Run
from avn.pipeline.scenes import DirectSound, heard_sound
from avn.pipeline.sounds import dry_sounds, microphone_of
from avn.pipeline.views import RenderedViews


def observed_stages(cfg: DictConfig) -> tuple[DirectSound, RenderedViews]:
    """Return the stages of a run's acoustics and views."""
    apartments = Apartments(cfg, cfg.subset)
    return heard_sound(cfg, apartments), RenderedViews(cfg, apartments)


class RunObservations:
    """Views and clips in a run's apartments, built where they are missing.

    They do not depend on the agent: agents without camera or microphone have them too.

    Parameters
    ----------
    run : Run
        Finished run.
    """

    def __init__(self, run: Run) -> None:
        cfg = run.cfg
        sound, rendered = observed_stages(cfg)
        build(sound)
        build(rendered)
        self._scenes = {scene.name: scene for scene in sound.load()}
        self._views = dict(zip(self._scenes, (views.rgb for views in rendered.load()), strict=True))
        # the clips of `SourceEstimates`: same microphone, seed and purpose
        clips, sounds = Clips(), dry_sounds(cfg)
        renderer = ClipRenderer(sounds, microphone_of(cfg), clips.seed_of(cfg), clips.purpose)
        shape = 2, renderer.sounds.rate
        self._clips = {
            name: RenderedClips(scene, renderer, cfg.realisations, unchanged, shape)
            for name, scene in self._scenes.items()
        }

    def views(self, scene: str, states: Sequence[int] | NDArray[np.int64]) -> NDArray[np.uint8]:
        """Return first-person views of some states of a scene, (N, H, W, 3) uint8."""
        return np.stack([self._views[scene][int(state)] for state in states])

    def clips(self, trace: Trace) -> Tensor:
        """Return the clip of each step, (T + 1, 2, rate) float32, left and right ear."""
        state, realisation = torch.from_numpy(trace.state), torch.from_numpy(trace.realisation)
        source, sound = (torch.full_like(state, own) for own in (trace.source, trace.sound))
        clip = ClipId(source, state, sound, realisation)
        return self._clips[trace.scene.name](clip, trace.mix)


def soundtrack(clips: Tensor) -> NDArray[np.float32]:
    """Concatenate clips of one second each, with cross-fades of 10 ms.

    Each clip is periodic, so it continues while the next one is faded in.

    Parameters
    ----------
    clips : (T, 2, rate) float32 tensor

    Returns
    -------
    (rate T, 2) float32
        Left and right, scaled by one factor to a peak of 0.9: the level still rises on the way to
        the source.
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
