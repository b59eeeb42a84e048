"""Stages of the occupancy network and of its estimates in every state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import pandas as pd
import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import build_grid
from avn.apartments.local_patch import window_cells, window_rooms
from avn.apartments.surfaces import build_surfaces
from avn.core.classes import build_object, import_class
from avn.core.errors import UserError
from avn.core.progress import progress_bar
from avn.core.settings import plain, typed
from avn.dataset.scene import Scene
from avn.dataset.views import Views
from avn.pipeline.fitted import Fitted
from avn.pipeline.per_scene import ApartmentTensors
from avn.pipeline.views import RenderedViews
from avn.views.local_patch_visibility import visible_cells
from avn.views.settings import CameraConfig

if TYPE_CHECKING:
    from lightning.pytorch.callbacks import Callback

    from avn.datamodules.views import ApartmentViews, ViewData
    from avn.modules.occupancy_cnn import OccupancyCnn

# Views of a batch at inference.
BATCH = 64
# Views that two cores train on in a second.
VIEWS_PER_SECOND = 200


def has_occupancy_model(cfg: DictConfig) -> bool:
    """Return whether the config has an occupancy network."""
    return bool(cfg.occupancy_model.name != "none")


def sees_rooms(cfg: DictConfig) -> bool:
    """Return whether the occupancy network estimates which cells are part of a room."""
    target = cfg.occupancy_model._target_
    return has_occupancy_model(cfg) and hasattr(import_class("occupancy_model", target), "rooms")


class OccupancyNetwork(Fitted):
    """Stage of the network that estimates which cells ahead are free and which visible."""

    kind = "train/occupancy_cnn"
    node = "occupancy_model"

    def check(self) -> None:
        """Refuse a config without an occupancy network."""
        if not has_occupancy_model(self.cfg):
            raise UserError("occupancy_model: 'none' sees no free cells; choose small or released")
        if self.cfg.occupancy_model.appearances < 1:
            given = self.cfg.occupancy_model.appearances
            raise UserError(f"occupancy_model.appearances: {given}; give 1 or more")
        super().check()

    def _views(self) -> list[RenderedViews]:
        seeds = range(self.cfg.occupancy_model.appearances)
        train = [RenderedViews(self.cfg, self.train, seed) for seed in seeds]
        return [*train, RenderedViews(self.cfg, self.validation)]

    def needs(self) -> Sequence[Any]:
        """Return the stages of training views in each appearance, and of validation views."""
        return self._views()

    def settings(self) -> Sequence[str]:
        """Return the key of the training recipe."""
        return ("occupancy_model",)

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        recipe = self.cfg.occupancy_model
        settings = f"{self.cfg.renderer.name}, train_seed {recipe.train_seed}"
        return f"occupancy network '{recipe.name}' ({settings})"

    def seconds(self) -> float:
        """Estimate the duration from the views of an epoch, trained on and measured."""
        recipe = self.cfg.occupancy_model
        views = [4 * apartments.cells for apartments in (self.train, self.validation)]
        measured = sum(self.in_epoch(min(count, recipe.validation_views)) for count in views)
        trained = self.in_epoch(views[0] * recipe.times)
        return float(self.epochs * (trained + measured) / VIEWS_PER_SECOND)

    def untrained(self) -> OccupancyCnn:
        """Return the network with its initial weights."""
        recipe = self.cfg.occupancy_model
        torch.manual_seed(recipe.train_seed)
        model: OccupancyCnn = build_object(
            "occupancy_model", recipe, camera=plain(self.cfg, "renderer.camera")
        )
        return model

    def data(self) -> ViewData:
        """Return the data module of views and true local patches."""
        from avn.datamodules.views import ViewData

        *train_views, validation_views = (stage.load() for stage in self._views())
        camera = typed(self.cfg.renderer.camera)
        train = zip(self.train.plans, *train_views, strict=True)
        validation = zip(self.validation.plans, validation_views, strict=True)
        return ViewData(
            [_seen(plan, camera, views) for plan, *views in train],
            [_seen(plan, camera, views) for plan, *views in validation],
            typed(self.cfg.occupancy_model),
        )

    def callbacks(self) -> Sequence[Callback]:
        """Return callbacks that log figures to TensorBoard."""
        from avn.reporting.local_patch_figures import LocalPatchFigures

        return (LocalPatchFigures(),)

    def measure(self, model: OccupancyCnn, data: ViewData) -> dict[str, Any]:
        """Return metrics over all validation views, of the network and of the prior."""
        from avn.modules.local_patch_metrics import calibrated, local_patch_metrics

        views = data.measured_views["validation"]
        predictions = []
        with torch.inference_mode():
            for items in torch.arange(len(views)).split(BATCH):
                log_odds = model.log_odds(views.__getitems__(items.tolist())["pictures"])
                predictions.append(calibrated(log_odds, model.calibration)[:, 0])
        free, prior = views.free.bool(), data.prior.expand(len(views), -1, -1)
        metrics: dict[str, Any] = {"prior": data.prior.tolist()}
        for name, estimate in (("validation", torch.cat(predictions)), ("prior", prior)):
            for metric, value in local_patch_metrics(estimate, free, views.visible).items():
                metrics[metric.replace("/", f"/{name}/", 1)] = value
        return metrics

    def prior(self) -> Tensor:
        """Return the share of training states in which each cell is free, (5, 5) float32."""
        return torch.tensor(self.metrics()["prior"])


def _seen(plan: FloorPlan, camera: CameraConfig, views: Sequence[Views]) -> ApartmentViews:
    from avn.datamodules.views import ApartmentViews

    free, visible = true_local_patches(plan, camera)
    return ApartmentViews(
        [v.rgb for v in views],
        [v.depth for v in views],
        free.numpy(),
        visible.numpy(),
        window_rooms(plan),
    )


def true_local_patches(plan: FloorPlan, camera: CameraConfig) -> tuple[Tensor, Tensor]:
    """Return which cells of every state's local patch are free and visible, (S, 5, 5) bool each."""
    grid = build_grid(plan)
    free = torch.from_numpy(window_cells(grid) >= 0)
    return free, torch.from_numpy(visible_cells(_surfaces(plan), grid, camera))


@lru_cache(maxsize=16)
def _surfaces(plan: FloorPlan) -> Any:
    return build_surfaces(plan)


class LocalPatches(ApartmentTensors):
    """Stage of local patches: the occupancy network's estimates in every state.

    The product is (S, 2, 5, 5) float32 per apartment: probabilities of free, then of visible; with
    a third, of being part of a room, if the network estimates it. Row r is r + 1 cells ahead,
    column c is c - 2 cells to the right.
    """

    kind = "see/local_patches"

    def needs(self) -> Sequence[Any]:
        """Return the stages of the network and of the views."""
        return (OccupancyNetwork(self.cfg), RenderedViews(self.cfg, self.apartments))

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return f"patches by '{self.cfg.occupancy_model.name}' in {self.apartments.title}"

    def seconds(self) -> float:
        """Estimate 2 ms per view."""
        return 4 * self.cells_left() * 0.002

    def opened(self) -> Callable[[int], Tensor]:
        """Load the network and the views; return the function from index to local patches."""
        network, rendered = self.needs()
        model, views = network.load(), rendered.load()
        names = [plan.name for plan in self.apartments.plans]
        return lambda index: infer_local_patches(model, views[index], names[index])

    def trusted(self) -> list[Tensor]:
        """Return probabilities of free, (S, 5, 5); NaN where visible is below the threshold."""
        return self._where_visible(0)

    def rooms(self) -> list[Tensor]:
        """Return probabilities of being part of a room, as `trusted` those of free."""
        return self._where_visible(2)

    def _where_visible(self, channel: int) -> list[Tensor]:
        threshold = self.cfg.mapper.visible_above
        return [
            torch.where(patches[:, 1] >= threshold, patches[:, channel], torch.nan)
            for patches in self.load()
        ]


@torch.inference_mode()
def infer_local_patches(model: OccupancyCnn, views: Views, name: str) -> Tensor:
    """Apply an occupancy network to every view of a scene.

    Parameters
    ----------
    model : OccupancyCnn
        Trained network.
    views : Views
        Views of S states.
    name : str
        Name of the scene, for the progress bar.

    Returns
    -------
    (S, 2 or 3, 5, 5) float32 tensor
        See `LocalPatches`.
    """
    rgb, patches = views.rgb, []
    with progress_bar(f"looking in {name}", len(rgb), "views") as advance:
        for first in range(0, len(rgb), BATCH):
            batch = torch.tensor(rgb[first : first + BATCH]).to(model.device)
            patches.append(model(batch).cpu())
            advance(len(batch))
    return torch.cat(patches)


def local_patch_errors(
    scenes: Sequence[Scene], camera: CameraConfig, estimates: Sequence[Tensor], prior: Tensor
) -> pd.DataFrame:
    """Compute metrics of local patches in each scene and over all, of network and prior.

    Parameters
    ----------
    scenes : sequence of Scene
        Scenes of the estimates.
    camera : CameraConfig
        Camera of the views, which determines the visible cells.
    estimates : sequence of (S, 5, 5) tensors
        Probability that each cell is free, by scene.
    prior : (5, 5) tensor
        Share of training states in which each cell is free.

    Returns
    -------
    DataFrame
        Columns scene, by (`network` or `prior`), cells (`all` or `visible`), accuracy, auc, ece and
        loss; the last rows are over all scenes.
    """
    from avn.modules.local_patch_metrics import local_patch_metrics

    truths = [true_local_patches(scene.plan, camera) for scene in scenes]
    free, visible = (torch.cat(tensors) for tensors in zip(*truths, strict=True))
    groups = [
        (scene.name, estimate, *truth)
        for scene, estimate, truth in zip(scenes, estimates, truths, strict=True)
    ]
    groups.append(("all", torch.cat(list(estimates)), free, visible))
    rows: list[dict[str, Any]] = []
    for name, estimate, *truth in groups:
        for by, prediction in (("network", estimate), ("prior", prior.expand_as(estimate))):
            metrics = local_patch_metrics(prediction, *truth)
            for cells in ("all", "visible"):
                row = {k.split("/")[0]: v for k, v in metrics.items() if k.endswith(f"/{cells}")}
                rows.append({"scene": name, "by": by, "cells": cells, **row})
    return pd.DataFrame(rows)
