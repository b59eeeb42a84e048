"""What the sound network's last layer makes of every clip, made where it is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.acoustics.clips import DrySounds
from avn.acoustics.dry_sounds import content_hash, load_sounds
from avn.core.hashing import digest
from avn.dataset import build
from avn.dataset.scene import Scene
from avn.pipeline import audio_inference, scenes, sound_network
from avn.pipeline.audio_inference import hear
from avn.pipeline.per_scene import Outcome

# Raised when the code of the stage changes its result.
VERSION = 1


@dataclass(frozen=True)
class Clips:
    """Which clips are listened to.

    Attributes
    ----------
    sounds : dict of str to str
        Name to built-in recording or path.
    takes : int
    purpose : {"eval", "train"}
        Whose takes; those of "eval" are the takes of `avn.pipeline.sound_network.hearing`.
    """

    sounds: dict[str, str]
    takes: int
    purpose: str = "eval"


def evaluated_clips(cfg: DictConfig) -> Clips:
    """The clips of an evaluation."""
    return Clips(audio_inference.sound_files(cfg), cfg.takes)


def features_hash(cfg: DictConfig, clips: Clips) -> str:
    """Hash of the features, beside the apartment: network, sounds in their order, takes."""
    sounds = list(content_hash(clips.sounds).items())
    heard = (sounds, clips.takes, clips.purpose, audio_inference.HEARING_SEED)
    return digest(sound_network.model_hash(cfg), *heard, VERSION)


def sound_features(cfg: DictConfig, chosen: Sequence[Scene], clips: Clips) -> list[Tensor]:
    """Features of clips of each scene.

    Parameters
    ----------
    chosen : sequence of Scene
    clips : Clips

    Returns
    -------
    list of (K, S, sounds, takes, D) float16 tensor
        See `avn.modules.sound_cnn.SoundCnn.features`.

    Raises
    ------
    UserError
        Where the config has no sound model, a file is damaged, or it is missing and `auto` is
        false.
    """
    sound_network.check_hears(cfg)
    network = cache(lambda: sound_network.sound_model(cfg)[0])
    acoustics = scenes.acoustics_of(cfg)
    pairs = sum(4 * s.grid.cells * len(s.sources) for s in chosen)
    count = pairs * len(clips.sounds) * clips.takes
    outcome = Outcome(
        stage="hear",
        what=f"features-{clips.purpose}-{'-'.join(clips.sounds)}",
        kind="sound-features",
        dataset="features",
        version=VERSION,
        made_from=features_hash(cfg, clips),
        title=f"sound features by '{cfg.sound_model.name}'",
        seconds=count / audio_inference.CLIPS_PER_SECOND,
    )

    def listen(scene: Scene) -> Tensor:
        model = network()
        found = hear(
            scene,
            acoustics.name,
            DrySounds(load_sounds(clips.sounds)),
            model,
            clips.takes,
            scenes.typed(cfg.microphone),
            seed=audio_inference.HEARING_SEED,
            purpose=clips.purpose,
            answer=model.features,
        )
        if clips == evaluated_clips(cfg) and model.symmetric:
            # the last two numbers are what the network says: nobody needs to listen again
            estimates = sound_network.hearing_outcome(cfg, chosen)
            made_from = build.first_arrival_hash(scene.plan, acoustics)
            estimates.put(cfg, scene, made_from, found[..., -2:].contiguous())
        return found.to(torch.float16)

    apartments = [build.first_arrival_hash(scene.plan, acoustics) for scene in chosen]
    return outcome.of(cfg, chosen, apartments, listen)
