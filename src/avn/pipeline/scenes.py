"""The config's floor plans and scenes, made where they are missing.

A result's folder is named by the hash of what it depends on (docs/architecture.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from avn.acoustics.brir import AcousticsConfig, check_config
from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import build_grid
from avn.apartments.splits import SplitConfig, load_split
from avn.core.errors import UserError
from avn.core.files import check_name, stage_folder
from avn.core.hashing import digest
from avn.dataset import build, scene
from avn.dataset.build_views import build_views, views_hash, views_made
from avn.dataset.scene import Scene
from avn.pipeline.stage import make_once

PARTS = ("train", "validation", "test")


def typed(node: DictConfig) -> Any:
    """The dataclass instance that a config node of a schema stands for."""
    return OmegaConf.to_object(node)


def acoustics_of(cfg: DictConfig) -> AcousticsConfig:
    """The node `acoustics`; raises `UserError` for a value that makes no sense."""
    return check_config(typed(cfg.acoustics))


def plans(cfg: DictConfig) -> dict[str, list[FloorPlan]]:
    """Floor plans of the split, by part: train, validation, test."""
    return _plans(OmegaConf.to_yaml(cfg.split, resolve=True), typed(cfg.split))


_PLANS: dict[str, dict[str, list[FloorPlan]]] = {}


def _plans(key: str, split: SplitConfig) -> dict[str, list[FloorPlan]]:
    # the folders' names and the stages ask for the same plans several times in one command
    if key not in _PLANS:
        _PLANS[key] = load_split(split)
    return _PLANS[key]


def pairs(cfg: DictConfig, part: str) -> tuple[int, int]:
    """How many pairs of source and free cell, and how many free cells, the apartments have."""
    found = [(len(plan.sources), build_grid(plan).cells) for plan in plans(cfg)[part]]
    return sum(sources * cells for sources, cells in found), sum(cells for _, cells in found)


def scenes_folder(cfg: DictConfig) -> Path:
    """The folder that holds the scene folders of the split."""
    acoustics = acoustics_of(cfg)
    hashes = [build.tail_hash(plan, acoustics) for part in plans(cfg).values() for plan in part]
    return stage_folder(cfg.outputs, "generate", cfg.split.name, digest(hashes))


def scenes(
    cfg: DictConfig, parts: Sequence[str] = PARTS, audible: bool = False, asked: bool = False
) -> dict[str, list[Scene]]:
    """The scenes of some parts of the split, made where they are missing.

    Parameters
    ----------
    parts : sequence of {"train", "validation", "test"}
    audible : bool
        Whether their impulse responses must be there too, in the regime of `acoustics`.
    asked : bool
        Whether it is them that the user asked for, so that `auto=false` does not refuse them.

    Raises
    ------
    UserError
        Where a part has no apartment, or something is missing and `auto` is false.
    """
    chosen = {part: plans(cfg)[part] for part in parts}
    for part, found in chosen.items():
        if not found:
            raise UserError(f"split.{part}: split '{cfg.split.name}' has no {part} apartment")
    acoustics = acoustics_of(cfg)
    check_name("split.name", cfg.split.name)
    check_name("acoustics.name", cfg.acoustics.name)
    if not cfg.outputs:
        raise UserError("outputs: empty; give the path of a folder")
    if cfg.processes < 1:
        raise UserError(f"processes: {cfg.processes} is less than 1; give 1 or more")
    folder = scenes_folder(cfg)
    auto = cfg.auto or asked
    for plan in (plan for found in chosen.values() for plan in found):
        if not auto and not scene.geometry_file(folder / plan.name).is_file():
            raise UserError(
                f"{folder / plan.name}: scene is missing and auto=false; leave auto=true to make it"
            )
    opened = {
        part: [build.build_geometry(plan, acoustics, folder / plan.name) for plan in found]
        for part, found in chosen.items()
    }
    if audible:
        every = [which for found in opened.values() for which in found]
        pairs = sum(len(which.sources) * which.grid.cells for which in every)
        make_once(
            folder,
            f"sound of the {', '.join(parts)} apartments of '{cfg.split.name}' ({acoustics.name})",
            done=lambda: build.acoustics_made(every, acoustics),
            make=lambda: build.build_acoustics(every, acoustics, cfg.processes),
            auto=auto,
            seconds=pairs * 0.02 / cfg.processes,
        )
    return opened


def views_hashes(cfg: DictConfig, parts: Sequence[str]) -> dict[str, list[str]]:
    """Hash of the views of each apartment of some parts of the split."""
    renderer = typed(cfg.renderer)
    return {part: [views_hash(plan, part, renderer) for plan in plans(cfg)[part]] for part in parts}


def seen_scenes(
    cfg: DictConfig, parts: Sequence[str] = PARTS, asked: bool = False
) -> dict[str, list[Scene]]:
    """The scenes of some parts of the split with their views, made where they are missing.

    Parameters and errors are those of `scenes`.
    """
    check_name("renderer.name", cfg.renderer.name)
    opened, renderer = scenes(cfg, parts, asked=asked), typed(cfg.renderer)
    every = [(which, part) for part, found in opened.items() for which in found]
    count = sum(4 * which.grid.cells for which, _ in every)
    make_once(
        scenes_folder(cfg),
        f"views of the {', '.join(parts)} apartments of '{cfg.split.name}' ({renderer.name})",
        done=lambda: views_made(every, renderer),
        make=lambda: build_views(every, renderer, cfg.processes),
        auto=cfg.auto or asked,
        seconds=(count * 0.06 + 60 * len(every)) / cfg.processes,
    )
    return opened
