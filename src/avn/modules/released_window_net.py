"""Occupancy network with the layer sizes of the code released by the paper's authors."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor, nn

from avn.apartments.local_patch import WINDOW
from avn.core.errors import UserError
from avn.views.settings import CameraConfig

OUTPUTS = 2


class ReleasedWindowNet(nn.Module):
    """Encoder-decoder CNN with dense layers that output the local patch.

    Four convolutions, a bottleneck, three transposed convolutions and two dense layers, with the
    sizes of the code released with Gan et al., "Look, Listen, and Act" (ICRA 2020). The release
    leaves open the strides, which are 2 here, and the pooling before the bottleneck, to 4 x 4
    here. The output for visible cells is added; there is none for depth.

    Parameters
    ----------
    camera : CameraConfig
        Not used.
    widths : sequence of 4 int
        Output channels of the convolutions, 1 or more each.
    decoder : int
        Size of the bottleneck, 1 or more.
    cell : int
        Size of the last hidden dense layer, 1 or more.
    dropout : float
        Dropout probability before each hidden dense layer.
    """

    def __init__(
        self,
        camera: CameraConfig,
        widths: Sequence[int] = (32, 48, 64, 64),
        decoder: int = 200,
        cell: int = 1000,
        dropout: float = 0.0,
    ) -> None:
        super().__init__()
        if len(widths) != 4 or min([*widths, decoder, cell]) < 1:
            raise UserError("net: widths are four numbers; these, decoder and cell 1 or more each")
        layers: list[nn.Module] = []
        before = 3
        for width, size in zip(widths, (7, 7, 5, 5), strict=True):
            layers += [nn.Conv2d(before, width, size, 2, padding=size // 2), nn.ReLU()]
            before = width
        layers += [
            nn.AdaptiveAvgPool2d(4),
            nn.Flatten(),
            nn.Linear(before * 16, decoder),
            nn.ReLU(),
        ]
        layers += [nn.Unflatten(1, (decoder, 1, 1))]
        before = decoder
        for width in (64, 32, 1):
            layers += [nn.ConvTranspose2d(before, width, 7), nn.ReLU()]
            before = width
        layers += [nn.Flatten()]
        size = 19 * 19
        for wide in (4096, cell):
            layers += [nn.Dropout(dropout), nn.Linear(size, wide), nn.ReLU()]
            size = wide
        layers += [nn.Linear(size, OUTPUTS * WINDOW * WINDOW)]
        layers += [nn.Unflatten(1, (OUTPUTS, WINDOW, WINDOW))]
        self.layers = nn.Sequential(*layers)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Map pictures (N, 3, size, size) to log-odds (N, 2, 5, 5) and a scalar 0 for depth."""
        log_odds = self.layers(pictures)
        return log_odds, log_odds.new_zeros(())
