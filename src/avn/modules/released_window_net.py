"""Occupancy network of the code released by the paper's authors."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor, nn

from avn.apartments.local_patch import WINDOW
from avn.core.errors import UserError
from avn.modules.plain_window_net import with_visible
from avn.modules.released_sound_net import EPSILON, MOMENTUM
from avn.views.settings import CameraConfig

KERNELS, TRANSPOSED = (7, 7, 5, 5), (64, 32, 1)


class ReleasedWindowNet(nn.Module):
    """Encoder-decoder CNN with dense layers that output the local patch.

    Four convolutions, a dense layer of each pixel, three transposed convolutions and two hidden
    dense layers, as in the code released with Gan et al., "Look, Listen, and Act" (ICRA 2020): all
    of stride 1, without padding and without pooling. The defaults are its sizes. The first dense
    layer of all pixels alone has 65 million weights for views of 128 x 128.

    Parameters
    ----------
    camera : CameraConfig
        Camera of the views; their size is used, 22 pixels or more.
    widths : sequence of 4 int
        Output channels of the convolutions, 1 or more each.
    decoder : int
        Size of the dense layer of each pixel, 1 or more.
    hidden : sequence of 2 int
        Sizes of the dense layers, 1 or more each.
    dropout : sequence of 3 float
        Dropout probability before each dense layer, the output layer included.

    Raises
    ------
    UserError
        Where a parameter is out of range.
    """

    def __init__(
        self,
        camera: CameraConfig,
        widths: Sequence[int] = (32, 48, 64, 64),
        decoder: int = 200,
        hidden: Sequence[int] = (4096, 1000),
        dropout: Sequence[float] = (0.25, 0.25, 0.4),
    ) -> None:
        super().__init__()
        if len(widths) != 4 or len(hidden) != 2 or min([*widths, *hidden, decoder]) < 1:
            raise UserError(
                "net: widths are four numbers and hidden two; these and decoder 1 or more each"
            )
        if len(dropout) != 3 or not all(0 <= own < 1 for own in dropout):
            raise UserError("net.dropout: three probabilities, 0 or more and less than 1")
        if camera.size < 22:
            raise UserError(f"renderer.camera.size: {camera.size}; the network needs 22 or more")
        layers: list[nn.Module] = []
        before = 3
        for width, kernel in zip(widths, KERNELS, strict=True):
            layers += [nn.Conv2d(before, width, kernel), nn.ReLU()]
            before = width
        layers += [nn.Conv2d(before, decoder, 1), nn.ReLU()]
        before = decoder
        for width in TRANSPOSED:
            layers += [nn.ConvTranspose2d(before, width, 7), nn.ReLU()]
            before = width
        layers[-1] = nn.Sigmoid()
        layers.append(nn.Flatten())
        size = (camera.size - 2) ** 2
        for wide, share in zip(hidden, dropout, strict=False):
            layers += [nn.Dropout(share), nn.Linear(size, wide), nn.ReLU()]
            layers += [nn.BatchNorm1d(wide, EPSILON, MOMENTUM)]
            size = wide
        layers += [nn.Dropout(dropout[-1]), nn.Linear(size, WINDOW * WINDOW)]
        self.layers = nn.Sequential(*layers)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Map pictures (N, 3, size, size) to log-odds (N, 2, 5, 5) and a scalar 0 for depth."""
        return with_visible(self.layers(pictures))
