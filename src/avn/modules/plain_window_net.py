"""Plain convolutional network from a view to the local patch, as the paper describes it."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from avn.apartments.local_patch import WINDOW
from avn.core.errors import UserError
from avn.modules.released_sound_net import EPSILON, MOMENTUM
from avn.views.settings import CameraConfig

# Log-odds of being visible, for networks that do not estimate it: they are asked about all cells.
VISIBLE = 30.0


class PlainWindowNet(nn.Module):
    """CNN of 3 x 3 convolutions of stride 2, followed by dense layers that output 5 x 5 cells.

    Parameters
    ----------
    camera : CameraConfig
        Camera of the views; their size is used.
    widths : sequence of int
        Output channels of each convolution, 1 or more each.
    hidden : sequence of int
        Sizes of the dense layers before the output layer, 1 or more each.
    dropout : float
        Dropout probability before each dense layer, 0 or more and less than 1.

    Raises
    ------
    UserError
        Where a parameter is out of range.
    """

    def __init__(
        self,
        camera: CameraConfig,
        widths: Sequence[int] = (16, 32, 64, 64),
        hidden: Sequence[int] = (64,),
        dropout: float = 0.25,
    ) -> None:
        super().__init__()
        if min([*widths, *hidden], default=1) < 1 or not 0 <= dropout < 1:
            raise UserError("net: widths and hidden are 1 or more each, dropout 0 to 1")
        layers: list[nn.Module] = []
        side = camera.size
        for before, after in zip((3, *widths), widths, strict=False):
            layers += [nn.Conv2d(before, after, 3, 2, padding=1), nn.ReLU()]
            layers += [nn.BatchNorm2d(after, EPSILON, MOMENTUM)]
            side = (side + 1) // 2
        layers.append(nn.Flatten())
        size = side * side * widths[-1]
        for wide in hidden:
            layers += [nn.Dropout(dropout), nn.Linear(size, wide), nn.ReLU()]
            size = wide
        layers += [nn.Dropout(dropout), nn.Linear(size, WINDOW * WINDOW)]
        self.layers = nn.Sequential(*layers)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Map pictures (N, 3, size, size) to log-odds (N, 2, 5, 5) and a scalar 0 for depth."""
        return with_visible(self.layers(pictures))


def with_visible(free: Tensor) -> tuple[Tensor, Tensor]:
    """Return outputs (N, 25) as log-odds (N, 2, 5, 5) of free and visible, and 0 for depth."""
    log_odds = free.unflatten(1, (WINDOW, WINDOW))
    return torch.stack((log_odds, torch.full_like(log_odds, VISIBLE)), 1), free.new_zeros(())
