"""What agents hear and see: a table of observations, each with the stage that makes it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.core.errors import UserError
from avn.core.settings import typed
from avn.dataset.scene import Scene
from avn.dataset.source_locations import locate_sources
from avn.navigation.observations import SceneObservations
from avn.pipeline.apartments import Apartments
from avn.pipeline.audio_features import AudioEmbeddings
from avn.pipeline.audio_inference import Clips
from avn.pipeline.occupancy import LocalPatches, sees_windows, true_windows
from avn.pipeline.sound_network import SourceEstimates, hears
from avn.pipeline.sounds import sound_files
from avn.pipeline.stop_classifier import StopProbabilities, can_stop
from avn.pipeline.views import RenderedViews
from avn.pipeline.visual_features import VisualEmbeddings

# What every agent observes without any stage.
OWN = ("collided", "odometry")


@dataclass(frozen=True)
class Observation:
    """Something that an agent may observe in each state.

    Attributes
    ----------
    shape : str
        What one observation of one agent is.
    audio : bool
        Whether it is of clips, (K, S, sounds, realisations, ...), or of states, (S, ...).
    stage : callable
        Config, apartments and clips to the stage that makes it.
    load : callable
        That stage to a tensor for each apartment.
    there : callable
        Whether a config has what makes it.
    hint : str
        What to do where it has not.
    truth : str, optional
        The part of `agent.oracle_inputs` that stands in for it.
    true : callable, optional
        Apartments and their scenes to the true tensors.
    settings : tuple of str
        Keys of the config that shape it beyond its stage.
    true_settings : tuple of str
        Keys of the config that shape the truth.
    """

    shape: str
    audio: bool
    stage: Callable[[DictConfig, Apartments, Clips], Any]
    load: Callable[[Any], list[Tensor]]
    there: Callable[[DictConfig], bool] = lambda cfg: True
    hint: str = ""
    truth: str | None = None
    true: Callable[[Apartments, Sequence[Scene]], list[Tensor]] | None = None
    settings: tuple[str, ...] = ()
    true_settings: tuple[str, ...] = ()


def _true_estimates(apartments: Apartments, scenes: Sequence[Scene]) -> list[Tensor]:
    sounds = len(sound_files(apartments.cfg, apartments.world))
    return [
        locate_sources(scene)[0][:, :, None, None].expand(-1, -1, sounds, -1, -1)
        for scene in scenes
    ]


def _true_patches(apartments: Apartments, scenes: Sequence[Scene]) -> list[Tensor]:
    camera = typed(apartments.cfg.renderer.camera)
    both = [true_windows(plan, camera) for plan in apartments.plans]
    return [torch.where(visible, free.float(), torch.nan) for free, visible in both]


OBSERVATIONS = {
    "source_estimate": Observation(
        shape="(2,): where the source is heard, metres right and front",
        hint="choose a sound model, such as sound_model=cnn5",
        audio=True,
        stage=SourceEstimates,
        load=SourceEstimates.load,
        there=hears,
        truth="source_estimate",
        true=_true_estimates,
    ),
    "stop_probability": Observation(
        shape="(): probability that the source is within reach",
        hint="choose what tells when to stop, such as stop_model=cnn5",
        audio=True,
        stage=StopProbabilities,
        load=StopProbabilities.load,
        there=can_stop,
    ),
    "audio_embedding": Observation(
        shape="(D,): last layer of the sound network",
        hint="choose a sound model, such as sound_model=cnn5",
        audio=True,
        stage=AudioEmbeddings,
        load=AudioEmbeddings.load,
        there=hears,
    ),
    "view": Observation(
        shape="(3, H, W): uint8 picture",
        audio=False,
        stage=lambda cfg, apartments, clips: RenderedViews(cfg, apartments),
        load=lambda stage: [
            torch.from_numpy(views.rgb[:]).permute(0, 3, 1, 2) for views in stage.load()
        ],
    ),
    "depth": Observation(
        shape="(H, W): metres",
        audio=False,
        stage=lambda cfg, apartments, clips: RenderedViews(cfg, apartments),
        load=lambda stage: [torch.from_numpy(views.depth[:]) for views in stage.load()],
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
        there=sees_windows,
        truth="local_patch",
        true=_true_patches,
        settings=("mapper.visible_above",),
        true_settings=tuple(f"renderer.camera.{own}" for own in ("height", "pitch", "fov")),
    ),
}


class Observed:
    """Observations in the apartments of one part of a world.

    Parameters
    ----------
    apartments : Apartments
    names : sequence of str
        Keys of `OBSERVATIONS`; others are left out, for an agent has them without any stage.
    clips : Clips, optional
        Which clips are heard; those of an evaluation by default.
    truth : sequence of str
        Parts in whose place the truth is shown.
    """

    def __init__(
        self,
        apartments: Apartments,
        names: Iterable[str],
        clips: Clips | None = None,
        truth: Sequence[str] = (),
    ) -> None:
        self.apartments, self.cfg = apartments, apartments.cfg
        self.names = [name for name in OBSERVATIONS if name in set(names)]
        self.clips, self._truth = clips or Clips(), truth

    def is_true(self, name: str) -> bool:
        """Whether an observation is the truth."""
        return OBSERVATIONS[name].truth in self._truth

    def check(self, agent: str, wanted: Sequence[str]) -> None:
        """Refuse observations that do not exist, or that the config has nothing for.

        Parameters
        ----------
        agent : str
            Who needs them, for the message.
        wanted : sequence of str
        """
        for truth in self._truth:
            shown = [name for name, own in OBSERVATIONS.items() if own.truth == truth]
            if shown and not set(shown) & set(wanted):
                raise UserError(
                    f"agent.oracle_inputs: '{truth}' is nothing that agent {agent} observes"
                )
        for name in wanted:
            start = f"agent {agent} needs the observation '{name}'"
            if name not in (*OBSERVATIONS, *OWN):
                raise UserError(f"{start}; there are {', '.join((*OBSERVATIONS, *OWN))}")
            if name in self.names and not self.is_true(name):
                own = OBSERVATIONS[name]
                if not own.there(self.cfg):
                    raise UserError(f"{start}: {own.hint}")

    @property
    def stages(self) -> dict[str, Any]:
        """The stage of each observation that is not the truth and that the config can make."""
        return {
            name: OBSERVATIONS[name].stage(self.cfg, self.apartments, self.clips)
            for name in self.names
            if not self.is_true(name) and OBSERVATIONS[name].there(self.cfg)
        }

    @property
    def settings(self) -> tuple[str, ...]:
        """Keys of the config that shape the observations beyond their stages."""
        keys: list[str] = []
        for name in self.names:
            own = OBSERVATIONS[name]
            keys += own.true_settings if self.is_true(name) else own.settings
        return tuple(dict.fromkeys(keys))

    def load(self, scenes: Sequence[Scene]) -> list[SceneObservations]:
        """Read all observations.

        Parameters
        ----------
        scenes : sequence of Scene
            Of the apartments.
        """
        observed: list[tuple[dict[str, Tensor], dict[str, Tensor]]] = [({}, {}) for _ in scenes]
        stages = self.stages
        for name in self.names:
            own = OBSERVATIONS[name]
            if self.is_true(name) and own.true:
                tensors = own.true(self.apartments, scenes)
            else:
                tensors = own.load(stages[name])
            for (audio, visual), tensor in zip(observed, tensors, strict=True):
                (audio if own.audio else visual)[name] = tensor
        return [SceneObservations(_alike(audio), visual) for audio, visual in observed]


def _alike(audio: dict[str, Tensor]) -> dict[str, Tensor]:
    """Audio observations with equal numbers of realisations; the truth has but one."""
    most = max((own.shape[3] for own in audio.values()), default=1)
    return {name: own.expand(*own.shape[:3], most, *own.shape[4:]) for name, own in audio.items()}
