"""The occupancy network: which of the cells ahead are free, from one picture."""

from __future__ import annotations

from typing import Any, TypedDict

import torch
from torch import Tensor, nn
from torchmetrics import MeanMetric

from avn.core.errors import UserError
from avn.modules.network import SPLITS, Network, OptimizerConfig, Part, as_part
from avn.modules.view_augment import AugmentConfig
from avn.modules.window_metrics import WindowScores, calibrated, calibration
from avn.views.camera import CameraConfig


class ViewBatch(TypedDict):
    """N views and what is to be known about them.

    pictures (N, 3, H, W) float32, 0 to 1; target (N, 5, 5) float32, 1 for free; visible (N, 5, 5)
    bool; inverse_depth (N, 1, H / 4, W / 4) float32, 1 / metres, 0 where there is nothing.
    """

    pictures: Tensor
    target: Tensor
    visible: Tensor
    inverse_depth: Tensor


WINDOW_NET: Part = {"_target_": "avn.modules.window_net.WindowNet"}


class OccupancyCnn(Network):
    """Network and the recipe that trains it.

    Parameters
    ----------
    name : str
        What the recipe is called.
    net, optimizer : dict
        Configs with `_target_`, as plain dicts.
    augment : dict
        An `AugmentConfig` as a plain dict, read by the data module.
    schedule, epochs, patience, batch, train_seed
        As those of `avn.modules.sound_cnn.SoundCnn`.
    appearances : int
        In how many looks (furniture models, patterns, light) training apartments are shown; read
        by the data module.
    times : int
        How often a view is shown in an epoch, changed anew each time; read by the data module.
    validation_views : int
        On how many views of each split it is measured after each epoch; read by the data module.
    flip_augmentation : bool
        Shows half of the training views mirrored, which is exact: so is the camera.
    flip_tta : bool
        Estimates as the mean over a view and its mirror image, mirrored back.
    visible_only : bool
        Whether only cells that can be seen are learned. If so, what it says of others is nothing
        to go by; if not, it learns how likely a hidden cell is free.
    depth_weight : float
        Weight of the error in depth (Eigen et al., NeurIPS 2014, in inverse metres here), learned
        beside, from the depth images of the training apartments; 0 for none.
    scaled : bool
        Whether log-odds get, after each epoch, the factor and the shift that fit the validation
        apartments best (see `avn.modules.window_metrics.calibration`): a network that learned two
        apartments is surer of others than it should be, and rooms differ in how full they are.
    """

    calibration: Tensor
    node = "occupancy_model"
    what = "occupancy network"
    unit = "views"
    monitor = "loss/validation/all"

    def __init__(
        self,
        name: str,
        net: Part = WINDOW_NET,
        optimizer: OptimizerConfig | Part | None = None,
        augment: AugmentConfig | Part | None = None,
        schedule: str = "cosine",
        epochs: int = 5,
        patience: int = 5,
        batch: int = 32,
        appearances: int = 2,
        times: int = 4,
        validation_views: int = 500,
        flip_augmentation: bool = True,
        flip_tta: bool = True,
        visible_only: bool = False,
        depth_weight: float = 1.0,
        scaled: bool = True,
        train_seed: int = 0,
        camera: dict[str, Any] | None = None,
    ) -> None:
        super().__init__()
        optimizer = as_part(optimizer or OptimizerConfig())
        augment = as_part(augment or AugmentConfig())
        self.save_hyperparameters()
        self.check_recipe()
        for key in ("appearances", "times", "validation_views"):
            if self.hparams[key] < 1:
                raise UserError(f"{self.node}.{key} is {self.hparams[key]}; give at least 1")
        if depth_weight < 0:
            raise UserError(f"{self.node}.depth_weight is {depth_weight}; give 0 or more")
        self.flip_tta, self.visible_only = flip_tta, visible_only
        if visible_only:
            self.monitor = "loss/validation/visible"  # type: ignore[misc]
        self.depth_weight, self.scaled = depth_weight, scaled
        built = self.build("net", camera=CameraConfig(**(camera or {})))
        self.net: nn.Module = built.to(memory_format=torch.channels_last)
        self.register_buffer("calibration", torch.tensor(((1.0, 0.0), (1.0, 0.0))))
        self.training_loss = MeanMetric()
        # Plain lists: they take what is already on the CPU and are no part of a checkpoint.
        self.scores = [WindowScores() for _ in SPLITS]

    def forward(self, views: Tensor) -> Tensor:
        """Judge N views.

        Parameters
        ----------
        views : (N, H, W, 3) uint8 tensor

        Returns
        -------
        (N, 2, 5, 5) float32 tensor
            Probabilities that each cell of the window is free, and that it is visible.
        """
        pictures = views.permute(0, 3, 1, 2).float() / 255
        return calibrated(self.log_odds(pictures), self.calibration)

    def log_odds(self, pictures: Tensor) -> Tensor:
        """(N, 3, H, W) pictures, 0 to 1, to (N, 2, 5, 5) log-odds before calibration."""
        if not self.flip_tta or self.training:
            return self._net(pictures)[0]
        straight, mirrored = self._net(torch.cat((pictures, pictures.flip(-1))))[0].chunk(2)
        return (straight + mirrored.flip(-1)) / 2

    def _net(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        centred = (pictures - 0.5) / 0.25
        return self.net(centred.contiguous(memory_format=torch.channels_last))

    def training_step(self, batch: ViewBatch, index: int) -> Tensor:
        """Cross-entropies of free and visible cells, and the error of the inverse depth."""
        log_odds, inverse_depth = self._net(batch["pictures"])
        visible = batch["visible"].float()
        loss = self._free_loss(log_odds[:, 0], batch["target"], visible)
        seen = nn.functional.binary_cross_entropy_with_logits(log_odds[:, 1], visible)
        self.training_loss.update(loss.detach(), len(visible))
        loss = loss + 0.5 * seen
        if self.depth_weight:
            known = (batch["inverse_depth"] > 0).float()
            error = (inverse_depth - batch["inverse_depth"]).abs() * known
            loss = loss + self.depth_weight * error.sum() / known.sum().clamp_min(1.0)
        return loss

    def _free_loss(self, log_odds: Tensor, free: Tensor, visible: Tensor) -> Tensor:
        each = nn.functional.binary_cross_entropy_with_logits(log_odds, free, reduction="none")
        if not self.visible_only:
            return each.mean()
        return (each * visible).sum() / visible.sum().clamp_min(1.0)

    def on_train_epoch_end(self) -> None:
        """Log the loss that the epoch's steps saw (with dropout, on changed pictures)."""
        self.log("loss/steps", self.training_loss.compute() * 1.0)
        self.training_loss.reset()

    def validation_step(self, batch: ViewBatch, index: int, dataloader_idx: int = 0) -> None:
        """Take in the answers to one batch of one of `SPLITS`."""
        log_odds = self.log_odds(batch["pictures"]).cpu()
        target, visible = batch["target"].cpu(), batch["visible"].cpu()
        self.scores[dataloader_idx].update(log_odds, target, visible)

    def on_validation_epoch_end(self) -> None:
        """Fit the calibration; log figures such as `auc/validation/visible`."""
        if self.scaled:
            log_odds, free, visible = self.scores[0].answers()
            chosen = visible if self.visible_only else torch.ones_like(visible)
            self.calibration[0] = calibration(log_odds[:, 0][chosen], free[chosen])
            self.calibration[1] = calibration(log_odds[:, 1], visible.float())
        for split, scores in zip(SPLITS, self.scores, strict=True):
            scores.calibration = self.calibration.cpu().clone()
            found = scores.compute()
            scores.reset()
            self.keep({name.replace("/", f"/{split}/", 1): v for name, v in found.items()})
