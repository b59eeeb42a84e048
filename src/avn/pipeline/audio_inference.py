"""What a network makes of every clip of an apartment, once for all walks through it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.acoustics.clips import ClipRenderer, DrySounds, MicrophoneConfig, brir_spectra
from avn.acoustics.dry_sounds import BUILTIN, content_hash, load_sounds
from avn.core.errors import UserError
from avn.core.files import check_name
from avn.core.prefetch import made_ahead, threads_for_one_operation
from avn.core.progress import progress_bar
from avn.dataset import build
from avn.dataset.scene import Scene
from avn.dataset.source_locations import where_sources_are
from avn.modules.listener import Listener
from avn.modules.sound_metrics import location_errors
from avn.pipeline import scenes
from avn.pipeline.per_scene import Outcome
from avn.reporting.results import ALL_SOUNDS

# Clips rendered at once; more would leave the caches of a CPU.
BATCH = 96
# What networks are trained on, whatever `sound=` says.
TRAINING_SOUNDS = {name: name for name in BUILTIN}
# Draws the takes of what is heard; an episode draws among them from its own seed.
HEARING_SEED = 0
MOST_TAKES = 1000
# How fast two cores listen, roughly, to say how long it takes.
CLIPS_PER_SECOND = 800


def sound_files(cfg: DictConfig) -> dict[str, str]:
    """The node `sound`: name to built-in recording or path.

    Raises
    ------
    UserError
        For a name that tables and folders need for something else.
    """
    sounds = {str(name): str(path) for name, path in cfg.sound.items()}
    for name in sounds:
        check_name("sound", name)
        if name == ALL_SOUNDS:
            raise UserError(f"sound: '{name}' is the row of all sounds; rename it")
    return sounds


def training_clips_hash(cfg: DictConfig) -> tuple[Any, ...]:
    """What every network that listens is trained on, for its hash."""
    acoustics = scenes.acoustics_of(cfg)
    apartments = {
        part: [build.first_arrival_hash(plan, acoustics) for plan in scenes.plans(cfg)[part]]
        for part in ("train", "validation")
    }
    return apartments, content_hash(TRAINING_SOUNDS), cfg.microphone


def training_time(cfg: DictConfig, recipe: DictConfig) -> float:
    """Seconds that training takes on two cores, roughly."""
    return float(4 * scenes.pairs(cfg, "train")[0] * recipe.epochs / 600)


def training_set(cfg: DictConfig) -> dict[str, Any]:
    """What every network that listens is trained on, for its data module."""
    return {
        **scenes.scenes(cfg, ("train", "validation"), audible=True),
        "regime": cfg.acoustics.name,
        "sounds": DrySounds(load_sounds(TRAINING_SOUNDS)),
        "microphone": scenes.typed(cfg.microphone),
    }


def heard_clips(cfg: DictConfig) -> tuple[Any, ...]:
    """Which clips are listened to, for a hash."""
    if not 1 <= cfg.takes <= MOST_TAKES:
        raise UserError(f"takes: {cfg.takes} is out of range; give 1 to {MOST_TAKES}")
    return list(content_hash(sound_files(cfg)).items()), cfg.takes, HEARING_SEED


def listening_time(cfg: DictConfig, chosen: Sequence[Scene]) -> float:
    """Seconds that listening to every clip of some scenes takes on two cores, roughly."""
    clips = sum(4 * s.grid.cells * len(s.sources) for s in chosen) * len(cfg.sound) * cfg.takes
    return clips / CLIPS_PER_SECOND


def listen(
    cfg: DictConfig, chosen: Sequence[Scene], open_model: Callable[[], Listener], outcome: Outcome
) -> list[Tensor]:
    """What a network makes of every clip of some scenes, made where it is missing.

    Parameters
    ----------
    cfg : DictConfig
    chosen : sequence of Scene
    open_model : callable
        Gives the trained network; called only where something is missing.
    outcome : Outcome
        The stage that keeps what the network says.

    Returns
    -------
    list of (K, S, sounds, takes, ...) float32 tensor
        Of each scene; see `hear`.
    """
    acoustics = scenes.acoustics_of(cfg)
    model = cache(open_model)

    def hear_scene(scene: Scene) -> Tensor:
        return hear(
            scene,
            acoustics.name,
            DrySounds(load_sounds(sound_files(cfg))),
            model(),
            cfg.takes,
            scenes.typed(cfg.microphone),
            seed=HEARING_SEED,
        )

    apartments = [build.first_arrival_hash(scene.plan, acoustics) for scene in chosen]
    return outcome.of(cfg, chosen, apartments, hear_scene)


def hear(
    scene: Scene,
    regime: str,
    sounds: DrySounds,
    model: Listener,
    takes: int,
    microphone: MicrophoneConfig,
    seed: int = 0,
    progress: bool = True,
    purpose: str = "eval",
    answer: Callable[[Tensor], Tensor] | None = None,
) -> Tensor:
    """Listen in every state to every source, with every sound, in each evaluation take.

    Parameters
    ----------
    scene : Scene
        An apartment with K sources and S = 4 C states.
    regime : str
        Which of its impulse responses.
    sounds : DrySounds
    model : Listener
        Trained; it is set to evaluation.
    takes : int
        Takes 0 to `takes` - 1 of the purpose.
    microphone : MicrophoneConfig
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
    brirs = scene.brirs(regime)
    renderer = ClipRenderer(sounds, microphone, seed, purpose)
    sources, states = len(scene.sources), 4 * len(scene.grid.lattice)
    source, state = torch.cartesian_prod(torch.arange(sources), torch.arange(states)).unbind(1)
    each = len(sounds.names) * takes
    sound, take = torch.cartesian_prod(torch.arange(len(sounds.names)), torch.arange(takes)).T
    heard: list[Tensor] = []
    model.eval()
    what = f"listening in {scene.name}"
    bar = progress_bar(what, len(source) * each, "clips") if progress else nullcontext(_silent)

    @torch.inference_mode()
    def listen(rows: Tensor) -> Tensor:
        # Whole pairs, so that an impulse response is transformed once for all its clips.
        spectra = brir_spectra(brirs.gather(source[rows], state[rows]))
        index = torch.arange(len(rows)).repeat_interleave(each)
        which = (source[rows][index], state[rows][index], sound.repeat(len(rows)))
        clips = renderer.render(spectra, *which, take.repeat(len(rows)), index)
        return (answer or model)(clips.to(model.device)).cpu()

    threads, parts = torch.get_num_threads(), torch.arange(len(source)).split(max(1, BATCH // each))
    with bar as advance, threads_for_one_operation(1):
        for found in made_ahead(listen, parts, threads):
            heard.append(found)
            advance(len(found))
    return torch.cat(heard).unflatten(0, (sources, states, len(sounds.names), takes))


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
    locations, visible = where_sources_are(scene)
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
                    "room": scene.name,
                    "sound": name,
                    "sight": sight,
                    "clips": len(m),
                    "error_m": float(np.median(m)) if len(m) else float("nan"),
                    "bearing_deg": float(np.median(d)) if len(d) else float("nan"),
                    "front_back": float((d > 90).mean()) if len(d) else float("nan"),
                }
            )
    return pd.DataFrame(rows)
