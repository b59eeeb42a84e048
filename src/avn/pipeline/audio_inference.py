"""What a network makes of every clip of an apartment, once for all episodes in it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import torch
from omegaconf import DictConfig, OmegaConf
from torch import Tensor

from avn.acoustics.clips import ClipRenderer, DrySounds, brir_spectra
from avn.acoustics.microphone import Microphone
from avn.core.classes import build_object
from avn.core.clip_id import ClipId
from avn.core.errors import UserError
from avn.core.prefetch import prefetch, threads_for_one_operation
from avn.core.progress import progress_bar
from avn.dataset.scene import AudibleScene, Scene
from avn.dataset.source_locations import locate_sources
from avn.modules.audio_network import AudioNetwork
from avn.modules.sound_metrics import location_errors
from avn.pipeline.apartments import Apartments
from avn.pipeline.per_scene import ApartmentTensors
from avn.pipeline.scenes import DirectSound
from avn.pipeline.sounds import dry_sounds, sound_files, sounds_content
from avn.pipeline.trained_on_clips import TrainedOnClips

# Clips rendered at once; more would leave the caches of a CPU.
BATCH = 96
# Draws the takes of what is heard; an episode draws among them from its own seed.
HEARING_SEED = 0
MOST_REALISATIONS = 1000
# How fast two cores listen, roughly, to say how long it takes.
CLIPS_PER_SECOND = 800


@dataclass(frozen=True)
class Clips:
    """Which clips are listened to.

    Attributes
    ----------
    realisations : str
        The key of the config that says how many takes there are of each clip.
    purpose : {"eval", "train"}
        Takes of the one are never those of the other.
    """

    realisations: str = "realisations"
    purpose: str = "eval"


class AudioInference(ApartmentTensors):
    """What a network makes of every clip of apartments.

    Parameters
    ----------
    cfg : DictConfig
    apartments : Apartments
        The sounds and the microphone are those of their world.
    clips : Clips
    """

    def __init__(self, cfg: DictConfig, apartments: Apartments, clips: Clips | None = None) -> None:
        super().__init__(cfg, apartments)
        self.clips = clips or Clips()

    @property
    @abstractmethod
    def network(self) -> TrainedOnClips:
        """The stage of the network that listens."""

    def answer(self, model: Any) -> Callable[[Tensor], Tensor]:
        """What is made of a batch of clips."""
        found: Callable[[Tensor], Tensor] = model
        return found

    @property
    def realisations(self) -> int:
        """How many takes there are of each clip."""
        return int(OmegaConf.select(self.cfg, self.clips.realisations))

    def needs(self) -> Sequence[Any]:
        """The network, and the sound of the apartments."""
        return (self.network, DirectSound(self.cfg, self.apartments))

    def settings(self) -> Sequence[str]:
        """The microphone, and how many takes there are."""
        return (self.apartments.world.microphone, self.clips.realisations)

    def consulted(self) -> Sequence[str]:
        """The sounds, whose recordings are in the fingerprint."""
        return (*super().consulted(), self.apartments.world.sounds)

    def content(self) -> Any:
        """The recordings, and what draws the takes."""
        return (
            sounds_content(self.cfg, self.apartments.world),
            self.clips.purpose,
            HEARING_SEED,
        )

    def seconds(self) -> float:
        """By the number of clips."""
        sounds = len(sound_files(self.cfg, self.apartments.world))
        return 4 * self.apartments.pairs * sounds * self.realisations / CLIPS_PER_SECOND

    def check(self) -> None:
        """Refuse a number of realisations that cannot be, and clips of another sampling rate."""
        rate, known = self.apartments.node("acoustics").rate, self.network.rate
        if rate != known:
            raise UserError(
                f"{self.apartments.world.acoustics}.rate: {rate}, and the {self.network.kind} is "
                f"trained at {known} Hz; give training.acoustics.rate the same"
            )
        if not 1 <= self.realisations <= MOST_REALISATIONS:
            raise UserError(
                f"{self.clips.realisations}: {self.realisations} is out of range; give 1 to "
                f"{MOST_REALISATIONS}"
            )

    def opened(self) -> Callable[[int], Tensor]:
        """Open the network and the scenes, and give what listens in one of them."""
        network, sound = self.needs()
        model, scenes = network.load(), sound.load()
        sounds = dry_sounds(self.cfg, self.apartments.world)
        microphone = build_object("microphone", self.apartments.node("microphone"))

        def listen(index: int) -> Tensor:
            return hear(
                scenes[index],
                sounds,
                model,
                self.realisations,
                microphone,
                seed=HEARING_SEED,
                purpose=self.clips.purpose,
                answer=self.answer(model),
            )

        return listen


def hear(
    scene: AudibleScene,
    sounds: DrySounds,
    model: AudioNetwork,
    realisations: int,
    microphone: Microphone,
    seed: int = 0,
    progress: bool = True,
    purpose: str = "eval",
    answer: Callable[[Tensor], Tensor] | None = None,
) -> Tensor:
    """Listen in every state to every source, with every sound, in each evaluation take.

    Parameters
    ----------
    scene : AudibleScene
        An apartment with K sources and S = 4 C states.
    sounds : DrySounds
    model : AudioNetwork
        Trained; it is set to evaluation.
    realisations : int
        Takes 0 to `realisations` - 1 of the purpose.
    microphone : Microphone
    seed : int
        Draws the takes.
    progress : bool
        Whether a bar with rate and time left is shown.
    purpose : {"eval", "train"}
        Takes of the one are never those of the other.
    answer : callable, optional
        What is made of clips; by default what the model says.

    Returns
    -------
    (K, S, sounds, takes, ...) float32 tensor
        The model's answer to each clip; for the sound network 2 metres, right and front.
    """
    brirs = scene.brirs
    renderer = ClipRenderer(sounds, microphone, seed, purpose)
    sources, states = len(scene.sources), 4 * len(scene.grid.lattice)
    source, state = torch.cartesian_prod(torch.arange(sources), torch.arange(states)).unbind(1)
    each = len(sounds.names) * realisations
    sound, realisation = torch.cartesian_prod(
        torch.arange(len(sounds.names)), torch.arange(realisations)
    ).T
    heard: list[Tensor] = []
    model.eval()
    what = f"listening in {scene.name}"
    bar = progress_bar(what, len(source) * each, "clips") if progress else nullcontext(_silent)

    @torch.inference_mode()
    def listen(rows: Tensor) -> Tensor:
        # Whole pairs, so that an impulse response is transformed once for all its clips.
        spectra = brir_spectra(brirs.gather(source[rows], state[rows]), sounds.rate)
        index = torch.arange(len(rows)).repeat_interleave(each)
        repeated = sound.repeat(len(rows)), realisation.repeat(len(rows))
        clip = ClipId(source[rows][index], state[rows][index], *repeated)
        clips = renderer.render(spectra, clip, index)
        return (answer or model)(clips.to(model.device)).cpu()

    threads, parts = torch.get_num_threads(), torch.arange(len(source)).split(max(1, BATCH // each))
    with bar as advance, threads_for_one_operation(1):
        for found in prefetch(listen, parts, threads):
            heard.append(found)
            advance(len(found))
    return torch.cat(heard).unflatten(0, (sources, states, len(sounds.names), realisations))


def _silent(count: int) -> None:
    """Show no progress."""


def sound_errors(scene: Scene, heard: Tensor, sounds: Sequence[str]) -> pd.DataFrame:
    """Report how far what is heard lies from where the sources are.

    Parameters
    ----------
    scene : Scene
    heard : (K, S, sounds, takes, 2) float32 tensor
        As `hear` gives it.
    sounds : sequence of str
        Their names.

    Returns
    -------
    DataFrame
        A row for each sound, and `all`, in sight, out of sight and in both together. Columns:
        room, sound, sight, clips, error_m and bearing_deg (medians), front_back (share of clips
        whose bearing is off by more than 90 degrees).
    """
    locations, visible = locate_sources(scene)
    metres, degrees = location_errors(heard, locations[:, :, None, None])
    in_sight = visible[:, :, None, None].expand_as(metres)
    sight_masks = {"in_sight": in_sight, "out_of_sight": ~in_sight, "all": in_sight | True}
    rows = []
    for index, name in enumerate((*sounds, "all")):
        chosen = slice(None) if name == "all" else slice(index, index + 1)
        for sight, mask in sight_masks.items():
            picked = mask[:, :, chosen]
            m, d = metres[:, :, chosen][picked].numpy(), degrees[:, :, chosen][picked].numpy()
            rows.append(
                {
                    "scene": scene.name,
                    "sound": name,
                    "sight": sight,
                    "clips": len(m),
                    "error_m": float(np.median(m)) if len(m) else float("nan"),
                    "bearing_deg": float(np.median(d)) if len(d) else float("nan"),
                    "front_back": float((d > 90).mean()) if len(d) else float("nan"),
                }
            )
    return pd.DataFrame(rows)
