"""The features by which places are known again, made where they are missing."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.core.files import check_name
from avn.core.hashing import digest
from avn.core.progress import progress_bar
from avn.dataset.features import features_file, read_features, write_features
from avn.dataset.scene import Scene
from avn.dataset.scene_file import is_there
from avn.pipeline import scenes
from avn.pipeline.stage import make_once
from avn.views.backbone import backbone_class, backbone_hash
from avn.views.backbone import features as features_of


def features_hash(cfg: DictConfig, views_made_from: str) -> str:
    """Hash of the features of one apartment's views."""
    return digest(views_made_from, backbone_hash(scenes.typed(cfg.backbone)))


def features(cfg: DictConfig, parts: Sequence[str]) -> dict[str, list[Tensor]]:
    """Features of the views of every state of the apartments of some parts of the split.

    Returns
    -------
    dict of list of (S, D) float32 tensor
        l2-normalised.

    Raises
    ------
    UserError
        Where the backbone's weights cannot be had, a file is damaged or of another making, or
        something is missing and `auto` is false.
    """
    check_name("backbone.name", cfg.backbone.name)
    opened, hashes = scenes.scenes(cfg, parts), scenes.views_hashes(cfg, parts)
    name = cfg.backbone.name
    if cfg.renderer.name != "raycast":  # two renderers' features lie beside each other
        name += f"-{cfg.renderer.name}"
    every = [
        (which, views, features_hash(cfg, views))
        for part in parts
        for which, views in zip(opened[part], hashes[part], strict=True)
    ]

    def missing() -> list[tuple[Scene, str, str]]:
        return [e for e in every if not is_there(features_file(e[0].folder, name), e[2])]

    def make() -> None:
        scenes.seen_scenes(cfg, parts)
        backbone = backbone_class(scenes.typed(cfg.backbone))(scenes.typed(cfg.backbone))
        for which, views, own in missing():
            seen = which.views(cfg.renderer.name, views)
            with progress_bar(f"features of {which.name}", len(seen.rgb), "views") as done:
                found = features_of(backbone, seen.rgb, done)
            write_features(which.folder, name, found, own, views)

    states = sum(4 * which.grid.cells for which, _, _ in every)
    make_once(
        scenes.scenes_folder(cfg),
        f"features of the {', '.join(parts)} views ({name})",
        done=lambda: not missing(),
        make=make,
        auto=cfg.auto,
        seconds=states / 100,
    )
    return {
        part: [
            torch.from_numpy(
                read_features(which.folder, name, 4 * which.grid.cells, features_hash(cfg, views))
            )
            for which, views in zip(opened[part], hashes[part], strict=True)
        ]
        for part in parts
    }
