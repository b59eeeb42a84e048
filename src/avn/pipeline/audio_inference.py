"""Inference of audio networks on every clip of an apartment, once for all episodes."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import torch
from omegaconf import DictConfig, OmegaConf
from torch import Tensor

from avn.acoustics.clips import ClipRenderer, DrySounds, brir_spectra
from avn.acoustics.microphone import Microphone
from avn.core.clip_id import ClipId
from avn.core.errors import UserError
from avn.core.prefetch import prefetch, threads_for_one_operation
from avn.core.progress import progress_bar
from avn.dataset.scene import AudibleScene, Scene
from avn.dataset.source_locations import locate_sources
from avn.pipeline.apartments import Apartments
from avn.pipeline.per_scene import ApartmentTensors
from avn.pipeline.scenes import DirectSound
from avn.pipeline.sounds import (
    check_heard,
    dry_sounds,
    microphone_of,
    sound_files,
    sounds_content,
)

if TYPE_CHECKING:
    from avn.modules.audio_network import AudioNetwork

# Clips rendered at once; more would leave the caches of a CPU.
BATCH = 96
MOST_REALISATIONS = 1000
# Rough speed of inference on two cores, for estimates of durations.
CLIPS_PER_SECOND = 1500


@dataclass(frozen=True)
class Clips:
    """Set of clip realisations.

    Attributes
    ----------
    realisations : str
        Config key of the number of realisations of each clip.
    purpose : {"eval", "train"}
        Use of the clips; realisations of the two are disjoint.
    seed : str, optional
        Config key of the seed of the realisations, that of the episodes by default. None is a
        seed of 0, for clips on which networks are trained or selected.
    """

    realisations: str = "realisations"
    purpose: str = "eval"
    seed: str | None = "seed"

    def settings(self) -> tuple[str, ...]:
        """Return the keys of the config that change the realisations."""
        return (self.realisations, *(() if self.seed is None else (self.seed,)))

    def seed_of(self, cfg: DictConfig) -> int:
        """Return the seed of the realisations."""
        return 0 if self.seed is None else int(OmegaConf.select(cfg, self.seed))


# Clips of the apartments in which an actor-critic is selected.
SELECTION_CLIPS = Clips(seed=None)
# Clips of the apartments in which an actor-critic is trained.
TRAINING_CLIPS = Clips("algorithm.realisations", "train", None)


def check_realisations(cfg: DictConfig, clips: Clips) -> None:
    """Raise `UserError` for a number of realisations that is out of range."""
    count = OmegaConf.select(cfg, clips.realisations)
    if not 1 <= count <= MOST_REALISATIONS:
        raise UserError(
            f"{clips.realisations}: {count} is out of range; give 1 to {MOST_REALISATIONS}"
        )


class AudioInference(ApartmentTensors):
    """Stage of a network's outputs for every clip of apartments.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.
    apartments : Apartments
        Apartments; sounds and microphone are those of their world.
    clips : Clips, optional
        Clip realisations; those of an evaluation by default.
    """

    def __init__(self, cfg: DictConfig, apartments: Apartments, clips: Clips | None = None) -> None:
        super().__init__(cfg, apartments)
        self.clips = clips or Clips()

    @property
    @abstractmethod
    def network(self) -> Any:
        """Stage of the network, with the sampling rate `rate` of its clips."""

    def output_of(self, model: Any) -> Callable[..., Tensor]:
        """Return the function from a batch of clips to outputs; the model by default."""
        forward: Callable[..., Tensor] = model
        return forward

    @property
    def where(self) -> str:
        """Apartments and, where it changes the clips, the seed of the episodes; for titles."""
        seed = "" if self.clips.seed is None else f", seed {self.clips.seed_of(self.cfg)}"
        return f"{self.apartments.title}{seed}"

    @property
    def realisations(self) -> int:
        """Number of realisations of each clip."""
        return int(OmegaConf.select(self.cfg, self.clips.realisations))

    def needs(self) -> Sequence[Any]:
        """Return the stages of the network and of the apartments' acoustics."""
        return (self.network, DirectSound(self.cfg, self.apartments))

    def settings(self) -> Sequence[str]:
        """Return the keys of the microphone and of the realisations."""
        return (self.apartments.world.microphone, *self.clips.settings())

    def consulted(self) -> Sequence[str]:
        """Return the keys of split and sounds; the fingerprint holds their content instead."""
        return (*super().consulted(), self.apartments.world.sounds)

    def content(self) -> Any:
        """Return the hashes of the recordings, and the use of the clips."""
        return (sounds_content(self.cfg, self.apartments.world), self.clips.purpose)

    def seconds(self) -> float:
        """Estimate the duration from the number of clips."""
        sounds = len(sound_files(self.cfg, self.apartments.world))
        return 4 * self.pairs_left() * sounds * self.realisations / CLIPS_PER_SECOND

    def check(self) -> None:
        """Refuse settings of the clips that cannot work, and another sampling rate."""
        rate, known = self.apartments.node("acoustics").rate, self.network.rate
        if rate != known:
            raise UserError(
                f"{self.apartments.world.acoustics}.rate: {rate}, and the {self.network.kind} is "
                f"trained at {known} Hz; give training.acoustics.rate the same"
            )
        check_realisations(self.cfg, self.clips)
        check_heard(self.cfg, self.apartments.world)

    def opened(self) -> Callable[[int], Tensor]:
        """Load the network and the scenes; return the function from index to outputs."""
        network, sound = self.needs()
        model, scenes = network.load(), sound.load()
        sounds = dry_sounds(self.cfg, self.apartments.world)
        microphone = microphone_of(self.cfg, self.apartments.world)

        def infer_in(index: int) -> Tensor:
            return infer(
                scenes[index],
                sounds,
                model,
                self.realisations,
                microphone,
                seed=self.clips.seed_of(self.cfg),
                purpose=self.clips.purpose,
                output=self.output_of(model),
            )

        return infer_in


def infer(
    scene: AudibleScene,
    sounds: DrySounds,
    model: AudioNetwork,
    realisations: int,
    microphone: Microphone,
    seed: int = 0,
    progress: bool = True,
    purpose: str = "eval",
    output: Callable[[Tensor], Tensor] | None = None,
) -> Tensor:
    """Apply a network to the clips of every source, state, sound and realisation.

    Parameters
    ----------
    scene : AudibleScene
        Apartment with K sources and S = 4 C states.
    sounds : DrySounds
        Recordings.
    model : AudioNetwork
        Trained network; it is set to evaluation.
    realisations : int
        Number of realisations of each clip.
    microphone : Microphone
        Microphone of the agent.
    seed : int
        Seed of the realisations.
    progress : bool
        Whether a progress bar is shown.
    purpose : {"eval", "train"}
        Use of the clips; realisations of the two are disjoint.
    output : callable, optional
        Function from clips to outputs; `model` by default.

    Returns
    -------
    (K, S, sounds, realisations, ...) float32 tensor
        Output for each clip; for the sound network 2 metres, right and front.
    """
    brirs = scene.brirs
    renderer = ClipRenderer(sounds, microphone, seed, purpose)
    sources, states = len(scene.sources), 4 * len(scene.grid.lattice)
    source, state = torch.cartesian_prod(torch.arange(sources), torch.arange(states)).unbind(1)
    clips_per_pair = len(sounds.names) * realisations
    sound, realisation = torch.cartesian_prod(
        torch.arange(len(sounds.names)), torch.arange(realisations)
    ).T
    outputs: list[Tensor] = []
    model.eval()
    what, total = f"listening in {scene.name}", len(source) * clips_per_pair
    bar = progress_bar(what, total, "clips") if progress else nullcontext(_silent)

    @torch.inference_mode()
    def infer_pairs(rows: Tensor) -> Tensor:
        # Whole pairs, so that an impulse response is transformed once for all its clips.
        spectra = brir_spectra(brirs.gather(source[rows], state[rows]), sounds.rate)
        index = torch.arange(len(rows)).repeat_interleave(clips_per_pair)
        repeated = sound.repeat(len(rows)), realisation.repeat(len(rows))
        clip = ClipId(source[rows][index], state[rows][index], *repeated)
        clips = renderer.render(spectra, clip, index)
        return (output or model)(clips.to(model.device)).cpu()

    threads = torch.get_num_threads()
    batches = torch.arange(len(source)).split(max(1, BATCH // clips_per_pair))
    with bar as advance, threads_for_one_operation(1):
        for batch in prefetch(infer_pairs, batches, threads):
            outputs.append(batch)
            advance(len(batch))
    return torch.cat(outputs).unflatten(0, (sources, states, len(sounds.names), realisations))


def _silent(count: int) -> None:
    """Show no progress."""


def source_estimate_errors(scene: Scene, estimates: Tensor, sounds: Sequence[str]) -> pd.DataFrame:
    """Compute the errors of source estimates by sound and sight.

    Parameters
    ----------
    scene : Scene
        Apartment with K sources and S states.
    estimates : (K, S, sounds, realisations, 2) float32 tensor
        Metres right and front, as `infer` gives them.
    sounds : sequence of str
        Names of the sounds.

    Returns
    -------
    DataFrame
        A row for each sound and for `all`, in sight, out of sight and both together. Columns:
        scene, sound, sight, clips, error_m and bearing_deg (medians), front_back (share of clips
        with a bearing error of more than 90 degrees).
    """
    from avn.modules.sound_metrics import location_errors

    locations, visible = locate_sources(scene)
    metres, degrees = location_errors(estimates, locations[:, :, None, None])
    in_sight = visible[:, :, None, None].expand_as(metres)
    sight_masks = {"in_sight": in_sight, "out_of_sight": ~in_sight, "all": in_sight | True}
    rows = []
    for index, name in enumerate((*sounds, "all")):
        columns = slice(None) if name == "all" else slice(index, index + 1)
        for sight, mask in sight_masks.items():
            clips = mask[:, :, columns]
            m, d = metres[:, :, columns][clips].numpy(), degrees[:, :, columns][clips].numpy()
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
