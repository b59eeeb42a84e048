"""What an agent hears and sees in the apartments that it walks, made where it is missing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.dataset.scene import Scene
from avn.dataset.source_locations import where_sources_are
from avn.pipeline import (
    audio_features,
    occupancy,
    scenes,
    sound_network,
    stop_classifier,
    visual_features,
)

SOUNDS, SIGHTS = ("sound", "reach", "sound_feature"), ("view", "depth", "feature", "window")


def heard(
    cfg: DictConfig, rooms: Sequence[Scene], wanted: Sequence[str]
) -> list[dict[str, Tensor]]:
    """What is heard in each room, by the name of the observation.

    Parameters
    ----------
    wanted : sequence of str
        Observations that the agent needs; those that are not heard are left out, and so is what
        the config has no network for.

    Returns
    -------
    list of dict of (K, S, sounds, takes, ...) tensor
    """
    found: list[dict[str, Tensor]] = [{} for _ in rooms]
    if not set(wanted) & set(SOUNDS):
        return found
    if "sound" in wanted and "location" in cfg.agent.truth:
        for room, own in zip(rooms, found, strict=True):
            where = where_sources_are(room)[0][:, :, None, None]
            own["sound"] = where.expand(-1, -1, len(cfg.sound), cfg.takes, -1)
    elif "sound" in wanted and sound_network.hears(cfg):
        scenes.scenes(cfg, (cfg.part,), audible=True)
        for own, estimates in zip(found, sound_network.hearing(cfg, rooms), strict=True):
            own["sound"] = estimates
    if "sound_feature" in wanted and sound_network.hears(cfg):
        scenes.scenes(cfg, (cfg.part,), audible=True)
        features = audio_features.sound_features(cfg, rooms, audio_features.evaluated_clips(cfg))
        for own, found_here in zip(found, features, strict=True):
            own["sound_feature"] = found_here
    if "reach" in wanted and stop_classifier.can_stop(cfg):
        scenes.scenes(cfg, (cfg.part,), audible=True)
        for own, scores in zip(found, stop_classifier.stop_scores(cfg, rooms), strict=True):
            own["reach"] = scores
    return found


def seen(cfg: DictConfig, rooms: Sequence[Scene], wanted: Sequence[str]) -> list[dict[str, Tensor]]:
    """What is seen in each room, by the name of the observation; as `heard`.

    Returns
    -------
    list of dict of (S, ...) tensor
    """
    found: list[dict[str, Tensor]] = [{} for _ in rooms]
    if "window" in wanted and "window" in cfg.agent.truth:
        for room, own in zip(rooms, found, strict=True):
            free, seen_there = occupancy.true_windows(cfg, room)
            own["window"] = torch.where(seen_there, free.float(), torch.nan)
    elif "window" in wanted and occupancy.sees_windows(cfg):
        for own, said in zip(found, occupancy.trusted_windows(cfg, rooms), strict=True):
            own["window"] = said
    if "feature" in wanted:
        for own, features in zip(
            found, visual_features.features(cfg, (cfg.part,))[cfg.part], strict=True
        ):
            own["feature"] = features
    if {"view", "depth"} & set(wanted):
        scenes.seen_scenes(cfg, (cfg.part,))
        hashes = scenes.views_hashes(cfg, (cfg.part,))[cfg.part]
        for room, own, made_from in zip(rooms, found, hashes, strict=True):
            views = room.views(cfg.renderer.name, made_from)
            if "view" in wanted:
                own["view"] = torch.from_numpy(views.rgb[:]).permute(0, 3, 1, 2)
            if "depth" in wanted:
                own["depth"] = torch.from_numpy(views.depth[:])
    return found


def senses_hash(cfg: DictConfig, wanted: Sequence[str]) -> list[Any]:
    """What the observations of an agent depend on beside the apartments, for the run's hash."""
    parts: list[Any] = []
    if "sound" in wanted and sound_network.hears(cfg) and "location" not in cfg.agent.truth:
        parts.append(sound_network.hear_hash(cfg))
    if "sound_feature" in wanted and sound_network.hears(cfg):
        parts.append(audio_features.features_hash(cfg, audio_features.evaluated_clips(cfg)))
    if "reach" in wanted and stop_classifier.can_stop(cfg):
        parts += [
            stop_classifier.stop_hash(cfg),
            cfg.stop_model.criterion,
            cfg.stop_model.threshold,
        ]
    if set(wanted) & set(SIGHTS):
        views = scenes.views_hashes(cfg, (cfg.part,))[cfg.part]
        if "feature" in wanted:
            parts.append([visual_features.features_hash(cfg, own) for own in views])
        if {"view", "depth"} & set(wanted):
            parts.append(views)
        if "window" in wanted:
            true = "window" in cfg.agent.truth
            parts.append(cfg.renderer.camera if true else _window_hash(cfg, views))
    return parts


def _window_hash(cfg: DictConfig, views: list[str]) -> Any:
    if not occupancy.sees_windows(cfg):
        return None
    return [occupancy.see_hash(cfg), cfg.mapper.visible_above, views]
