"""The occupancy network of a config, and what it sees in every state, made where it is missing."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

import pandas as pd
import torch
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from torch import Tensor

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.local_patch import window_cells
from avn.apartments.surfaces import build_surfaces
from avn.core.errors import UserError
from avn.core.files import stage_folder
from avn.core.hashing import digest
from avn.core.progress import progress_bar
from avn.datamodules.views import Seen, ViewData
from avn.dataset.build_views import build_views, views_hash, views_made
from avn.dataset.scene import Scene
from avn.modules.occupancy_cnn import OccupancyCnn
from avn.modules.window_metrics import calibrated, window_metrics
from avn.pipeline import scenes
from avn.pipeline.per_scene import Outcome
from avn.pipeline.stage import make_once
from avn.pipeline.trained import read_metrics, trained
from avn.reporting.window_figures import WindowFigures
from avn.views.window import visible_cells

# Raised when the code of a stage changes its result.
VERSIONS = {"occupancy_cnn": 1, "see": 1}
# Views that are judged at once.
BATCH = 64
TRAINED_ON = ("train", "validation")


def sees_windows(cfg: DictConfig) -> bool:
    """Whether the config has an occupancy network."""
    return bool(cfg.occupancy_model.name != "none")


def _check_sees(cfg: DictConfig) -> None:
    if not sees_windows(cfg):
        raise UserError("occupancy_model: 'none' sees no free cells; choose small or released")


def model_hash(cfg: DictConfig) -> str:
    """Hash of what the occupancy network's weights depend on."""
    renderer, plans = scenes.typed(cfg.renderer), scenes.plans(cfg)
    looks = {"train": range(cfg.occupancy_model.looks), "validation": range(1)}
    views = {
        part: [views_hash(plan, part, renderer, look) for plan in plans[part] for look in own]
        for part, own in looks.items()
    }
    return digest(views, cfg.occupancy_model, VERSIONS["occupancy_cnn"])


def occupancy_model(cfg: DictConfig, asked: bool = False) -> tuple[OccupancyCnn, Path]:
    """The trained occupancy network and its folder; trains it where it is missing.

    Parameters
    ----------
    asked : bool
        Whether it is the network that the user asked for, so that `auto=false` does not refuse it.

    Raises
    ------
    UserError
        Where the config has no such network, or a checkpoint belongs to another config.
    """
    _check_sees(cfg)
    recipe = cfg.occupancy_model
    camera: Any = OmegaConf.to_container(cfg.renderer.camera, resolve=True)
    torch.manual_seed(recipe.train_seed)
    model: OccupancyCnn = instantiate(recipe, camera=camera)
    folder = stage_folder(cfg.outputs, "train", "occupancy_cnn", model_hash(cfg))
    settings = f"{cfg.renderer.name}, train_seed {recipe.train_seed}"
    title = f"occupancy network '{recipe.name}' ({settings})"
    views = 4 * scenes.pairs(cfg, "train")[1] * recipe.times * recipe.epochs
    data = partial(_data, cfg)
    figures = [WindowFigures()]
    model = trained(cfg, model, folder, title, data, _measure, figures, asked, views / 90)
    return model, folder


def _data(cfg: DictConfig) -> ViewData:
    opened = scenes.seen_scenes(cfg, TRAINED_ON)
    looks = range(cfg.occupancy_model.looks)
    make_looks(cfg)
    train = [_seen(cfg, scene, looks) for scene in opened["train"]]
    validation = [_seen(cfg, scene, range(1)) for scene in opened["validation"]]
    return ViewData(train, validation, scenes.typed(cfg.occupancy_model))


def make_looks(cfg: DictConfig) -> None:
    """Furnish, paint and light the training apartments anew, as often as the recipe says."""
    looks = range(cfg.occupancy_model.looks)
    rooms = scenes.scenes(cfg, ("train",))["train"]
    renderer, every = scenes.typed(cfg.renderer), [(scene, "train") for scene in rooms]
    count = sum(4 * scene.grid.cells for scene in rooms) * (len(looks) - 1)
    make_once(
        scenes.scenes_folder(cfg),
        f"{len(looks)} looks of the train apartments of '{cfg.split.name}' ({renderer.name})",
        done=lambda: views_made(every, renderer, looks),
        make=lambda: build_views(every, renderer, cfg.processes, looks),
        auto=cfg.auto,
        seconds=(count * 0.06 + 60 * len(rooms) * (len(looks) - 1)) / cfg.processes,
    )


def _seen(cfg: DictConfig, scene: Scene, looks: Sequence[int]) -> Seen:
    renderer = scenes.typed(cfg.renderer)
    part = _part_of(cfg, scene)
    views = [
        scene.views(renderer.name, views_hash(scene.plan, part, renderer, look), look)
        for look in looks
    ]
    free, visible = true_windows(cfg, scene)
    return Seen([v.rgb for v in views], [v.depth for v in views], free.numpy(), visible.numpy())


def true_windows(cfg: DictConfig, scene: Scene) -> tuple[Tensor, Tensor]:
    """Which cells of every state's window are free, and which visible, (S, 5, 5) bool each."""
    camera = scenes.typed(cfg.renderer).camera
    free = torch.from_numpy(window_cells(scene.grid) >= 0)
    return free, torch.from_numpy(visible_cells(_surfaces(scene.plan), scene.grid, camera))


@lru_cache(maxsize=16)
def _surfaces(plan: FloorPlan) -> Any:
    return build_surfaces(plan)


def _part_of(cfg: DictConfig, scene: Scene) -> str:
    """The part of the split that an apartment belongs to."""
    for part, plans in scenes.plans(cfg).items():
        if scene.name in (plan.name for plan in plans):
            return part
    raise UserError(f"split: '{cfg.split.name}' has no apartment {scene.name}")


def _measure(model: OccupancyCnn, data: ViewData) -> dict[str, Any]:
    """Figures over all views of the validation apartments, and those of the prior beside."""
    views = data.measured_views["validation"]
    said = []
    with torch.inference_mode():
        for items in torch.arange(len(views)).split(BATCH):
            log_odds = model.log_odds(views.__getitems__(items.tolist())["pictures"])
            said.append(calibrated(log_odds, model.calibration)[:, 0])
    free, prior = views.free.bool(), data.prior.expand(len(views), -1, -1)
    figures: dict[str, Any] = {"prior": data.prior.tolist()}
    for name, estimate in (("validation", torch.cat(said)), ("prior", prior)):
        for figure, value in window_metrics(estimate, free, views.visible).items():
            figures[figure.replace("/", f"/{name}/", 1)] = value
    return figures


def windows(cfg: DictConfig, chosen: Sequence[Scene]) -> list[Tensor]:
    """How likely each cell of every state's window is free, made where it is missing.

    Parameters
    ----------
    chosen : sequence of Scene
        Apartments of the split, of any part.

    Returns
    -------
    list of (S, 5, 5) float32
        Row r is r + 1 cells ahead, column c is c - 2 cells to the right.
    """
    return [found[:, 0].contiguous() for found in _windows(cfg, chosen)]


def sights(cfg: DictConfig, chosen: Sequence[Scene]) -> list[Tensor]:
    """How likely each cell of every state's window is visible; as `windows`."""
    return [found[:, 1].contiguous() for found in _windows(cfg, chosen)]


def trusted_windows(cfg: DictConfig, chosen: Sequence[Scene]) -> list[Tensor]:
    """As `windows`, with NaN where a cell is not visible enough to tell anything."""
    both = zip(windows(cfg, chosen), sights(cfg, chosen), strict=True)
    return [torch.where(sight >= cfg.mapper.visible_above, said, torch.nan) for said, sight in both]


def window_prior(cfg: DictConfig) -> Tensor:
    """How often each cell of the window is free in the training apartments, (5, 5) float32."""
    return torch.tensor(read_metrics(occupancy_model(cfg)[1])["prior"])


def see_hash(cfg: DictConfig) -> str:
    """Hash of what is seen, beside the apartment."""
    return digest(model_hash(cfg), VERSIONS["see"])


def _windows(cfg: DictConfig, chosen: Sequence[Scene]) -> list[Tensor]:
    """Probabilities of free and of visible cells, (S, 2, 5, 5) for each apartment."""
    _check_sees(cfg)
    renderer = scenes.typed(cfg.renderer)
    parts = [_part_of(cfg, scene) for scene in chosen]
    hashes = [
        views_hash(scene.plan, part, renderer) for scene, part in zip(chosen, parts, strict=True)
    ]
    made_from = dict(zip([scene.name for scene in chosen], hashes, strict=True))
    states = sum(4 * scene.grid.cells for scene in chosen)
    outcome = Outcome(
        stage="see",
        what=cfg.occupancy_model.name,
        kind="windows",
        dataset="probabilities",
        version=VERSIONS["see"],
        made_from=see_hash(cfg),
        title=f"what occupancy network '{cfg.occupancy_model.name}' sees",
        seconds=states / 100,
    )

    @cache
    def network() -> OccupancyCnn:
        scenes.seen_scenes(cfg, sorted(set(parts)))
        return occupancy_model(cfg)[0]

    def see(scene: Scene) -> Tensor:
        return judge_views(network(), scene, renderer.name, made_from[scene.name])

    return outcome.of(cfg, chosen, hashes, see)


@torch.inference_mode()
def judge_views(model: OccupancyCnn, scene: Scene, renderer: str, made_from: str) -> Tensor:
    """Probabilities of free and of visible cells for every view, (S, 2, 5, 5) float32."""
    rgb, found = scene.views(renderer, made_from).rgb, []
    with progress_bar(f"looking in {scene.name}", len(rgb), "views") as advance:
        for first in range(0, len(rgb), BATCH):
            views = torch.tensor(rgb[first : first + BATCH]).to(model.device)
            found.append(model(views).cpu())
            advance(len(views))
    return torch.cat(found)


def window_errors(
    cfg: DictConfig, rooms: Sequence[Scene], estimates: Sequence[Tensor]
) -> pd.DataFrame:
    """How well windows are known in each room and in all of them, beside the prior.

    Parameters
    ----------
    rooms : sequence of Scene
    estimates : sequence of (S, 5, 5) tensors
        As `windows` gives them.

    Returns
    -------
    DataFrame
        Columns room, by (`network` or `prior`), cells (`all` or `visible`), accuracy, auc, ece and
        loss; the last rows are of all rooms.
    """
    prior = window_prior(cfg)
    truths = [true_windows(cfg, room) for room in rooms]
    free, visible = (torch.cat(each) for each in zip(*truths, strict=True))
    groups = [
        (room.name, said, *truth)
        for room, said, truth in zip(rooms, estimates, truths, strict=True)
    ]
    groups.append(("all", torch.cat(list(estimates)), free, visible))
    rows: list[dict[str, Any]] = []
    for name, said, *truth in groups:
        for by, estimate in (("network", said), ("prior", prior.expand_as(said))):
            found = window_metrics(estimate, *truth)
            for cells in ("all", "visible"):
                own = {k.split("/")[0]: v for k, v in found.items() if k.endswith(f"/{cells}")}
                rows.append({"room": name, "by": by, "cells": cells, **own})
    return pd.DataFrame(rows)
