"""The occupancy network and what it sees in every state, as stages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import pandas as pd
import torch
from lightning.pytorch.callbacks import Callback
from omegaconf import DictConfig
from torch import Tensor

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import build_grid
from avn.apartments.local_patch import window_cells
from avn.apartments.surfaces import build_surfaces
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.progress import progress_bar
from avn.core.settings import plain, typed
from avn.datamodules.views import ApartmentViews, ViewData
from avn.dataset.scene import Scene
from avn.dataset.views import Views
from avn.modules.occupancy_cnn import OccupancyCnn
from avn.modules.window_metrics import calibrated, window_metrics
from avn.pipeline.per_scene import ApartmentTensors
from avn.pipeline.trained import Fitted
from avn.pipeline.views import RenderedViews
from avn.reporting.local_patch_figures import LocalPatchFigures
from avn.views.camera import CameraConfig
from avn.views.local_patch_visibility import visible_cells

# Views that are judged at once.
BATCH = 64


def sees_windows(cfg: DictConfig) -> bool:
    """Whether the config has an occupancy network."""
    return bool(cfg.occupancy_model.name != "none")


class OccupancyNetwork(Fitted):
    """The network that says which cells around the agent are free and which visible."""

    kind = "train/occupancy_cnn"

    def check(self) -> None:
        """Refuse a config that has no such network."""
        if not sees_windows(self.cfg):
            raise UserError("occupancy_model: 'none' sees no free cells; choose small or released")
        if self.cfg.occupancy_model.appearances < 1:
            given = self.cfg.occupancy_model.appearances
            raise UserError(f"occupancy_model.appearances: {given}; give 1 or more")
        super().check()

    def _views(self) -> list[RenderedViews]:
        appearances = range(self.cfg.occupancy_model.appearances)
        train = [
            RenderedViews(self.cfg, self.train, appearance_seed) for appearance_seed in appearances
        ]
        return [*train, RenderedViews(self.cfg, self.validation)]

    def needs(self) -> Sequence[Any]:
        """Views of the training apartments in each look, and of the validation apartments."""
        return self._views()

    def settings(self) -> Sequence[str]:
        """The recipe."""
        return ("occupancy_model",)

    @property
    def title(self) -> str:
        """What it is."""
        recipe = self.cfg.occupancy_model
        settings = f"{self.cfg.renderer.name}, train_seed {recipe.train_seed}"
        return f"occupancy network '{recipe.name}' ({settings})"

    def seconds(self) -> float:
        """By the number of views and of epochs."""
        recipe = self.cfg.occupancy_model
        return float(4 * self.train.cells * recipe.times * recipe.epochs / 90)

    def untrained(self) -> OccupancyCnn:
        """The network before training."""
        recipe = self.cfg.occupancy_model
        torch.manual_seed(recipe.train_seed)
        model: OccupancyCnn = build_object(
            "occupancy_model", recipe, camera=plain(self.cfg, "renderer.camera")
        )
        return model

    def data(self) -> ViewData:
        """Views and the true patches that they show."""
        *appearances, others = (own.load() for own in self._views())
        camera = typed(self.cfg.renderer.camera)
        train = zip(self.train.plans, *appearances, strict=True)
        validation = zip(self.validation.plans, others, strict=True)
        return ViewData(
            [_seen(plan, camera, views) for plan, *views in train],
            [_seen(plan, camera, views) for plan, *views in validation],
            typed(self.cfg.occupancy_model),
        )

    def callbacks(self) -> Sequence[Callback]:
        """What shows figures in TensorBoard."""
        return (LocalPatchFigures(),)

    def measure(self, model: OccupancyCnn, data: ViewData) -> dict[str, Any]:
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

    def prior(self) -> Tensor:
        """How often each cell of a patch is free in the training apartments, (5, 5) float32."""
        return torch.tensor(self.metrics()["prior"])


def _seen(plan: FloorPlan, camera: CameraConfig, views: Sequence[Views]) -> ApartmentViews:
    free, visible = true_windows(plan, camera)
    return ApartmentViews(
        [v.rgb for v in views], [v.depth for v in views], free.numpy(), visible.numpy()
    )


def true_windows(plan: FloorPlan, camera: CameraConfig) -> tuple[Tensor, Tensor]:
    """Which cells of every state's window are free, and which visible, (S, 5, 5) bool each."""
    grid = build_grid(plan)
    free = torch.from_numpy(window_cells(grid) >= 0)
    return free, torch.from_numpy(visible_cells(_surfaces(plan), grid, camera))


@lru_cache(maxsize=16)
def _surfaces(plan: FloorPlan) -> Any:
    return build_surfaces(plan)


class LocalPatches(ApartmentTensors):
    """How likely each cell around the agent is free, and how likely visible, by the network.

    Its product is (S, 2, 5, 5) float32 for each apartment: free, then visible. Row r is r + 1
    cells ahead, column c is c - 2 cells to the right.
    """

    kind = "see/local_patches"

    def needs(self) -> Sequence[Any]:
        """The network, and the views."""
        return (OccupancyNetwork(self.cfg), RenderedViews(self.cfg, self.apartments))

    @property
    def title(self) -> str:
        """What it is."""
        return f"patches by '{self.cfg.occupancy_model.name}' in {self.apartments.title}"

    def seconds(self) -> float:
        """About 10 ms a view."""
        return 4 * self.apartments.cells / 100

    def opened(self) -> Callable[[int], Tensor]:
        """Open the network and the views, and give what looks at those of an apartment."""
        network, rendered = self.needs()
        model, views = network.load(), rendered.load()
        names = [plan.name for plan in self.apartments.plans]
        return lambda index: judge_views(model, views[index], names[index])

    def trusted(self) -> list[Tensor]:
        """How likely each cell is free, (S, 5, 5), NaN where too little visible to tell."""
        least = self.cfg.mapper.visible_above
        return [torch.where(own[:, 1] >= least, own[:, 0], torch.nan) for own in self.load()]


@torch.inference_mode()
def judge_views(model: OccupancyCnn, views: Views, name: str) -> Tensor:
    """Probabilities of free and of visible cells for every view, (S, 2, 5, 5) float32."""
    rgb, found = views.rgb, []
    with progress_bar(f"looking in {name}", len(rgb), "views") as advance:
        for first in range(0, len(rgb), BATCH):
            batch = torch.tensor(rgb[first : first + BATCH]).to(model.device)
            found.append(model(batch).cpu())
            advance(len(batch))
    return torch.cat(found)


def window_errors(
    rooms: Sequence[Scene], camera: CameraConfig, estimates: Sequence[Tensor], prior: Tensor
) -> pd.DataFrame:
    """How well windows are known in each room and in all of them, beside the prior.

    Parameters
    ----------
    rooms : sequence of Scene
    camera : CameraConfig
        Of the views; it says which cells are visible.
    estimates : sequence of (S, 5, 5) tensors
        How likely each cell is free.
    prior : (5, 5) tensor
        How often each cell is free in the training apartments.

    Returns
    -------
    DataFrame
        Columns room, by (`network` or `prior`), cells (`all` or `visible`), accuracy, auc, ece and
        loss; the last rows are of all rooms.
    """
    truths = [true_windows(room.plan, camera) for room in rooms]
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
                rows.append({"scene": name, "by": by, "cells": cells, **own})
    return pd.DataFrame(rows)
