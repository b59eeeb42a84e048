"""Occupancy network that is trained with the mean squared error, as the released code is."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn

from avn.modules.network import Part
from avn.modules.occupancy_cnn import OccupancyCnn, ViewBatch

PLAIN_NET: Part = {"_target_": "avn.modules.plain_window_net.PlainWindowNet"}


class PlainOccupancyCnn(OccupancyCnn):
    """Occupancy network with the mean squared error of the probabilities of all cells as loss.

    It estimates neither depth nor which cells are visible: the probability of being visible is 1.

    Parameters
    ----------
    net : dict
        Config of the network, with `_target_`.
    depth_weight : float
        0, as there is no estimate of depth.
    **recipe
        Those of `OccupancyCnn`.
    """

    def __init__(self, net: Part = PLAIN_NET, depth_weight: float = 0.0, **recipe: Any) -> None:
        super().__init__(net=net, depth_weight=depth_weight, **recipe)

    def training_step(self, batch: ViewBatch, index: int) -> Tensor:
        """Return the mean squared error over all cells."""
        log_odds, _ = self._net(batch["pictures"])
        loss = nn.functional.mse_loss(torch.sigmoid(log_odds[:, 0]), batch["target"])
        self.training_loss.update(loss.detach(), len(log_odds))
        return loss
