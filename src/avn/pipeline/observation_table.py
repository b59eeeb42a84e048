"""Table of the agents' observations, each with the stage that computes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.apartments.local_patch import window_rooms
from avn.core.settings import typed
from avn.dataset.arrivals import true_arrivals
from avn.dataset.scene import Scene
from avn.dataset.source_locations import locate_sources
from avn.pipeline.apartments import Apartments
from avn.pipeline.arrivals import ArrivalEstimates
from avn.pipeline.audio_features import AudioEmbeddings
from avn.pipeline.audio_inference import Clips
from avn.pipeline.occupancy import (
    LocalPatches,
    has_occupancy_model,
    sees_rooms,
    true_local_patches,
)
from avn.pipeline.rendered_audio import Spectrograms, Waveforms
from avn.pipeline.scenes import acoustics_of
from avn.pipeline.sound_network import SourceEstimates, has_sound_model, hears_arrivals
from avn.pipeline.sounds import sound_files
from avn.pipeline.stop_classifier import StopProbabilities, has_stop_model
from avn.pipeline.views import RenderedViews
from avn.pipeline.visual_features import VisualEmbeddings

# Observations that every agent has without any stage.
OWN = ("collided", "odometry")
# Keys that change which cells the camera sees.
_CAMERA = tuple(f"renderer.camera.{key}" for key in ("height", "pitch", "fov"))


@dataclass(frozen=True)
class Observation:
    """Kind of observation that an agent may have in each state.

    Attributes
    ----------
    shape : str
        Shape and meaning of one observation of one agent.
    audio : bool
        Whether its tensors are by clip, (K, S, sounds, realisations, ...), or by state, (S, ...).
    stage : callable
        Function of config, apartments and clips; returns the stage that computes it.
    load : callable
        Function of that stage; returns a tensor for each apartment, or a `RenderedAudio`.
    there : callable
        Function of the config; returns whether it has the network that computes it.
    hint : str
        Advice for a config without that network, for messages.
    truth : str, optional
        Entry of `agent.oracle_inputs` that replaces it by ground truth.
    true : callable, optional
        Function of apartments and scenes; returns the ground-truth tensors.
    settings : tuple of str
        Keys of the config that change it in addition to those of its stage.
    true_settings : tuple of str
        Keys of the config that change its ground truth.
    rendered : bool
        Whether it is rendered when an agent hears it, and in no tensor.
    """

    shape: str
    audio: bool
    stage: Callable[[DictConfig, Apartments, Clips], Any]
    load: Callable[[Any], list[Any]]
    there: Callable[[DictConfig], bool] = lambda cfg: True
    hint: str = ""
    truth: str | None = None
    true: Callable[[Apartments, Sequence[Scene]], list[Tensor]] | None = None
    settings: tuple[str, ...] = ()
    true_settings: tuple[str, ...] = ()
    rendered: bool = False


def _true_estimates(apartments: Apartments, scenes: Sequence[Scene]) -> list[Tensor]:
    sounds = len(sound_files(apartments.cfg, apartments.world))
    return [
        locate_sources(scene)[0][:, :, None, None].expand(-1, -1, sounds, -1, -1)
        for scene in scenes
    ]


def _true_arrivals(apartments: Apartments, scenes: Sequence[Scene]) -> list[Tensor]:
    sounds, acoustics = len(sound_files(apartments.cfg, apartments.world)), acoustics_of(apartments)
    return [
        true_arrivals(scene, acoustics)[:, :, None, None].expand(-1, -1, sounds, -1, -1)
        for scene in scenes
    ]


def _true_patches(apartments: Apartments, scenes: Sequence[Scene]) -> list[Tensor]:
    camera = typed(apartments.cfg.renderer.camera)
    both = [true_local_patches(plan, camera) for plan in apartments.plans]
    return [torch.where(visible, free.float(), torch.nan) for free, visible in both]


def _true_rooms(apartments: Apartments, scenes: Sequence[Scene]) -> list[Tensor]:
    camera = typed(apartments.cfg.renderer.camera)
    both = [
        (torch.from_numpy(window_rooms(plan)), true_local_patches(plan, camera)[1])
        for plan in apartments.plans
    ]
    return [torch.where(visible, rooms.float(), torch.nan) for rooms, visible in both]


OBSERVATIONS = {
    "source_estimate": Observation(
        shape="(2,): where the source is heard, metres right and front",
        hint="choose a sound model, such as sound_model=cnn5",
        audio=True,
        stage=SourceEstimates,
        load=SourceEstimates.load,
        there=has_sound_model,
        truth="source_estimate",
        true=_true_estimates,
    ),
    "arrival": Observation(
        shape="(B + 6,): how the sound arrives; see `avn.core.heard.Arrivals`",
        hint="choose a sound model with heads, such as sound_model=arrival",
        audio=True,
        stage=ArrivalEstimates,
        load=ArrivalEstimates.load,
        there=hears_arrivals,
        truth="arrival",
        true=_true_arrivals,
    ),
    "stop_probability": Observation(
        shape="(): probability that the source is within reach",
        hint="choose what tells when to stop, such as stop_model=cnn5",
        audio=True,
        stage=StopProbabilities,
        load=StopProbabilities.load,
        there=has_stop_model,
    ),
    "audio_embedding": Observation(
        shape="(D,): last layer of the sound network",
        hint="choose a sound model, such as sound_model=cnn5",
        audio=True,
        stage=AudioEmbeddings,
        load=AudioEmbeddings.load,
        there=has_sound_model,
    ),
    "waveform": Observation(
        shape="(2, rate): one second of sound at the left and the right ear",
        audio=True,
        stage=Waveforms,
        load=Waveforms.load,
        rendered=True,
    ),
    "spectrogram": Observation(
        shape="(channels, bands, frames): spectrogram of that second; see `Spectrogram`",
        audio=True,
        stage=Spectrograms,
        load=Spectrograms.load,
        rendered=True,
    ),
    "view": Observation(
        shape="(3, H, W): uint8 picture",
        audio=False,
        stage=lambda cfg, apartments, clips: RenderedViews(cfg, apartments),
        load=lambda stage: [
            torch.from_numpy(np.array(views.rgb)).permute(0, 3, 1, 2) for views in stage.load()
        ],
    ),
    "depth": Observation(
        shape="(H, W): metres",
        audio=False,
        stage=lambda cfg, apartments, clips: RenderedViews(cfg, apartments),
        load=lambda stage: [torch.from_numpy(np.array(views.depth)) for views in stage.load()],
    ),
    "visual_embedding": Observation(
        shape="(D,): last layer of the backbone, of length 1",
        audio=False,
        stage=lambda cfg, apartments, clips: VisualEmbeddings(cfg, apartments),
        load=VisualEmbeddings.load,
    ),
    "local_patch": Observation(
        shape="(5, 5): probability that cells ahead are free; NaN where none can tell",
        hint="choose what sees free squares, such as occupancy_model=small",
        audio=False,
        stage=lambda cfg, apartments, clips: LocalPatches(cfg, apartments),
        load=LocalPatches.trusted,
        there=has_occupancy_model,
        truth="local_patch",
        true=_true_patches,
        settings=("mapper.visible_above",),
        true_settings=_CAMERA,
    ),
    "local_rooms": Observation(
        shape="(5, 5): probability that cells ahead are part of a room; NaN where none can tell",
        hint="choose what tells rooms from walls, such as occupancy_model=rooms",
        audio=False,
        stage=lambda cfg, apartments, clips: LocalPatches(cfg, apartments),
        load=LocalPatches.rooms,
        there=sees_rooms,
        truth="local_patch",
        true=_true_rooms,
        settings=("mapper.visible_above",),
        true_settings=_CAMERA,
    ),
}
