"""Occupancy network: probabilities that the cells ahead are free, from one RGB view."""

from __future__ import annotations

from typing import Any, ClassVar, TypedDict

import torch
from torch import Tensor, nn
from torchmetrics import MeanMetric

from avn.core.errors import UserError
from avn.modules.local_patch_metrics import LocalPatchScores, calibrated, calibration
from avn.modules.network import SUBSETS, Network, Part, as_part
from avn.modules.settings import AugmentConfig, OptimizerConfig
from avn.views.settings import CameraConfig


class ViewBatch(TypedDict):
    """Batch of N views with labels.

    Attributes
    ----------
    pictures : (N, 3, H, W) float32 tensor
        RGB, 0 to 1.
    target : (N, 5, 5) float32 tensor
        1 where a cell is free, else 0.
    visible : (N, 5, 5) bool tensor
        Whether the camera sees any of a cell.
    rooms : (N, 5, 5) float32 tensor
        1 where a cell is part of a room or doorway, furnished or not, else 0.
    inverse_depth : (N, 1, H / 4, W / 4) float32 tensor
        1 / metres; 0 where there is no surface.
    """

    pictures: Tensor
    target: Tensor
    visible: Tensor
    rooms: Tensor
    inverse_depth: Tensor


FREE_AND_VISIBLE = 2
VISIBLE = 1
WINDOW_NET: Part = {"_target_": "avn.modules.window_net.WindowNet"}


class OccupancyCnn(Network):
    """Occupancy network: classifies the 5 x 5 cells ahead as free or occupied from one RGB view.

    Parameters
    ----------
    name : str
        Name of the option.
    net : dict
        Config of the network, with `_target_`.
    optimizer : dict
        Config of the optimiser, with `_target_`.
    augment : dict
        Config of the image augmentation, an `AugmentConfig`; read by the data module.
    schedule, epochs, patience, train_seed
        As those of `avn.modules.audio_network.AudioNetwork`.
    batch : int
        Views in a batch, 1 or more; read by the data module.
    appearances : int
        Number of appearances (furniture models, textures, light) in which the training apartments
        are rendered, 1 or more.
    times : int
        Number of times that an epoch shows each view, augmented anew each time, 1 or more; read
        by the data module.
    validation_views : int
        Number of views of each subset on which metrics are computed after each epoch, 1 or more;
        read by the data module.
    flip_augmentation : bool
        Whether each training view is mirrored with probability 0.5. This is exact, as the camera
        is symmetric.
    flip_tta : bool
        Test-time augmentation: whether an estimate is the mean over a view and its mirror image.
    visible_only : bool
        Whether the loss is over visible cells only. The probabilities of hidden cells then mean
        nothing; otherwise the network learns how likely a hidden cell is free.
    depth_weight : float
        Weight of the auxiliary loss on inverse depth, 0 or more; 0 turns it off (depth as in Eigen
        et al., NeurIPS 2014).
    scaled : bool
        Whether log-odds are calibrated on the validation apartments after each epoch, by Platt
        scaling (see `avn.modules.local_patch_metrics.calibration`). A network that is trained on
        two apartments is overconfident in others.
    camera : dict or None
        Config of the camera, a `CameraConfig`; its defaults if None.
    """

    calibration: Tensor
    node = "occupancy_model"
    what = "occupancy network"
    unit = "views"
    monitor = "loss/validation/all"
    # estimates of each cell
    outputs: ClassVar[int] = FREE_AND_VISIBLE

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
        more = {} if self.outputs == FREE_AND_VISIBLE else {"outputs": self.outputs}
        built = self.build("net", camera=CameraConfig(**(camera or {})), **more)
        self.net: nn.Module = built.to(memory_format=torch.channels_last)
        self.register_buffer("calibration", torch.tensor([(1.0, 0.0)] * self.outputs))
        self.training_loss = MeanMetric()
        # In a plain list metrics stay on the CPU and out of checkpoints.
        self.scores = [LocalPatchScores() for _ in SUBSETS]

    def forward(self, views: Tensor) -> Tensor:
        """Estimate occupancy and visibility of the cells ahead in N views.

        Parameters
        ----------
        views : (N, H, W, 3) uint8 tensor
            RGB.

        Returns
        -------
        (N, outputs, 5, 5) float32 tensor
            Calibrated probabilities that each cell is free, and that it is visible.
        """
        pictures = views.permute(0, 3, 1, 2).float() / 255
        return calibrated(self.log_odds(pictures), self.calibration)

    def log_odds(self, pictures: Tensor) -> Tensor:
        """Map pictures (N, 3, H, W), 0 to 1, to uncalibrated log-odds (N, outputs, 5, 5)."""
        if not self.flip_tta or self.training:
            return self._net(pictures)[0]
        straight, mirrored = self._net(torch.cat((pictures, pictures.flip(-1))))[0].chunk(2)
        return (straight + mirrored.flip(-1)) / 2

    def _net(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        centred = (pictures - 0.5) / 0.25
        return self.net(centred.contiguous(memory_format=torch.channels_last))

    def training_step(self, batch: ViewBatch, index: int) -> Tensor:
        """Return the loss: cross-entropies of free and visible, and the inverse-depth error."""
        log_odds, inverse_depth = self._net(batch["pictures"])
        visible = batch["visible"].float()
        loss = self._free_loss(log_odds[:, 0], batch["target"], visible)
        self.training_loss.update(loss.detach(), len(visible))
        loss = loss + self.other_losses(log_odds, batch)
        if self.depth_weight:
            known = (batch["inverse_depth"] > 0).float()
            error = (inverse_depth - batch["inverse_depth"]).abs() * known
            loss = loss + self.depth_weight * error.sum() / known.sum().clamp_min(1.0)
        return loss

    def other_losses(self, log_odds: Tensor, batch: ViewBatch) -> Tensor:
        """Return the losses of what it estimates of the cells besides free: half that of visible.

        Parameters
        ----------
        log_odds : (N, outputs, 5, 5) float32 tensor
        batch : ViewBatch
        """
        visible = batch["visible"].float()
        seen = nn.functional.binary_cross_entropy_with_logits(log_odds[:, 1], visible)
        return 0.5 * seen

    def _free_loss(self, log_odds: Tensor, free: Tensor, visible: Tensor) -> Tensor:
        each = nn.functional.binary_cross_entropy_with_logits(log_odds, free, reduction="none")
        if not self.visible_only:
            return each.mean()
        return (each * visible).sum() / visible.sum().clamp_min(1.0)

    def on_train_epoch_end(self) -> None:
        """Log the mean training loss of the epoch (with dropout and augmentation)."""
        self.log("loss/steps", self.training_loss.compute() * 1.0)
        self.training_loss.reset()

    def validation_step(self, batch: ViewBatch, index: int, dataloader_idx: int = 0) -> None:
        """Add one batch to the metrics of a subset.

        Parameters
        ----------
        batch : ViewBatch
            Views with labels.
        index : int
            Number of the batch; unused.
        dataloader_idx : int
            Index into `SUBSETS`.
        """
        log_odds = self.log_odds(batch["pictures"]).cpu()
        target, visible = batch["target"].cpu(), batch["visible"].cpu()
        self.scores[dataloader_idx].update(log_odds, target, visible, batch["rooms"].cpu())

    def on_validation_epoch_end(self) -> None:
        """Fit the calibration and log metrics such as `auc/validation/visible`."""
        if self.scaled:
            log_odds, *labels = self.scores[0].gathered()
            visible = labels[1]
            used = visible if self.visible_only else torch.ones_like(visible)
            for channel, label in enumerate(labels[: self.outputs]):
                cells = torch.ones_like(used) if channel == VISIBLE else used
                given = log_odds[:, channel][cells], label.float()[cells]
                self.calibration[channel] = calibration(*given)
        for subset, scores in zip(SUBSETS, self.scores, strict=True):
            scores.calibration = self.calibration.cpu().clone()
            metrics = scores.compute()
            scores.reset()
            self.keep({name.replace("/", f"/{subset}/", 1): v for name, v in metrics.items()})
