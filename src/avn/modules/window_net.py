"""From a picture to the cells ahead: features are looked up where each cell is in the picture."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor, nn

from avn.apartments.floor_plan import CELL
from avn.apartments.local_patch import WINDOW, window_offsets
from avn.core.errors import UserError
from avn.views.camera import CameraConfig

# Where in a cell features are looked up, in metres: right and front of its centre, over the floor.
PROBES = (
    (0.0, 0.0, 0.0),
    (-0.18, -0.18, 0.0),
    (0.18, -0.18, 0.0),
    (-0.18, 0.18, 0.0),
    (0.18, 0.18, 0.0),
    (0.0, 0.0, 0.4),
    (0.0, 0.0, 0.8),
    (0.0, 0.0, 1.3),
)
OUTPUTS = 2


def probe_places(camera: CameraConfig) -> tuple[Tensor, Tensor]:
    """Where the probes of each cell of the window lie in the picture.

    Parameters
    ----------
    camera : CameraConfig

    Returns
    -------
    places : (25, P, 2) float32 tensor
        Right and down from the middle of the picture, -1 and 1 at its edges; held to -1..1.
    inverse_depth : (25, P) float32 tensor
        1 / metres along the camera's axis.
    """
    cells = window_offsets().reshape(-1, 1, 2) * CELL
    probes = np.array(PROBES)
    right, front = np.moveaxis(cells + probes[:, :2], -1, 0)
    up = probes[:, 2] - camera.height
    pitch, edge = math.radians(camera.pitch), math.tan(math.radians(camera.fov) / 2)
    depth = np.maximum(front * math.cos(pitch) + up * math.sin(pitch), 0.05)
    height = up * math.cos(pitch) - front * math.sin(pitch)
    places = np.stack((right, -height), -1) / (depth * edge)[..., None]
    places = np.clip(places, -1.0, 1.0).astype(np.float32)
    return torch.from_numpy(places), torch.from_numpy((1.0 / depth).astype(np.float32))


def _layer(before: int, after: int, stride: int = 1, size: int = 3) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(before, after, size, stride, padding=size // 2, bias=False),
        nn.BatchNorm2d(after),
        nn.ReLU(inplace=True),
    )


def _doubled(features: Tensor) -> Tensor:
    return nn.functional.interpolate(features, scale_factor=2.0)


class WindowNet(nn.Module):
    """A U-shaped network, whose features are looked up where the window's cells are.

    The camera stands and looks the same way always, so each cell of the window has its place in
    the picture. Looking features up there, and the same layers for all cells, leave the network
    little else to go by than what is seen of a cell, which carries over to other apartments
    (the idea of spatial transformers, Jaderberg et al., NeurIPS 2015, with fixed places).
    The network also estimates depth, and compares it with that of the cell.

    Parameters
    ----------
    camera : CameraConfig
    widths : sequence of 4 int
        Channels at a half, a quarter, an eighth and a sixteenth of the picture's size.
    decoder : int
        Channels at a quarter of the size, from which features are looked up.
    cell : int
        Channels of each cell.
    dropout : float
        Share of a cell's channels that training silences.
    """

    places: Tensor
    inverse_depth: Tensor

    def __init__(
        self,
        camera: CameraConfig,
        widths: Sequence[int] = (16, 32, 64, 96),
        decoder: int = 32,
        cell: int = 64,
        dropout: float = 0.1,
    ) -> None:
        super().__init__()
        if len(widths) != 4 or min([*widths, decoder, cell]) < 1:
            raise UserError("net: widths are four numbers; these, decoder and cell 1 or more each")
        if not 0 <= dropout < 1:
            raise UserError(f"net.dropout is {dropout}; give 0 or more, less than 1")
        places, inverse_depth = probe_places(camera)
        self.register_buffer("places", places, persistent=False)
        self.register_buffer("inverse_depth", inverse_depth, persistent=False)
        half, quarter, eighth, sixteenth = widths
        self.to_half = _layer(3, half, 2, 5)
        self.to_quarter = nn.Sequential(_layer(half, quarter, 2), _layer(quarter, quarter))
        self.to_eighth = nn.Sequential(_layer(quarter, eighth, 2), _layer(eighth, eighth))
        self.to_sixteenth = nn.Sequential(
            _layer(eighth, sixteenth, 2), _layer(sixteenth, sixteenth)
        )
        self.from_sixteenth = nn.Conv2d(sixteenth, decoder, 1)
        self.from_eighth = nn.Conv2d(eighth, decoder, 1)
        self.from_quarter = nn.Conv2d(quarter, decoder, 1)
        self.join_eighth = _layer(decoder, decoder)
        self.join_quarter = _layer(decoder, decoder)
        self.depth = nn.Conv2d(decoder, 1, 1)
        probes = len(PROBES)
        self.look = nn.Sequential(
            nn.Linear(probes * (decoder + 1), cell), nn.ReLU(), nn.Dropout(dropout)
        )
        self.place = nn.Parameter(torch.zeros(WINDOW * WINDOW, cell))
        self.scene = nn.Linear(sixteenth, cell)
        # Cells tell their neighbours what they see: walls go on, and near things hide far ones.
        self.neighbours = nn.Sequential(_layer(cell, cell), _layer(cell, cell))
        self.answer = nn.Conv2d(2 * cell, OUTPUTS, 1)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Judge N pictures.

        Parameters
        ----------
        pictures : (N, 3, size, size) float32 tensor

        Returns
        -------
        log_odds : (N, 2, 5, 5) float32 tensor
            That each cell is free, and that it is visible.
        inverse_depth : (N, 1, size / 4, size / 4) float32 tensor
            1 / metres along the camera's axis.
        """
        quarter = self.to_quarter(self.to_half(pictures))
        eighth = self.to_eighth(quarter)
        deep = self.to_sixteenth(eighth)
        # From coarse to fine, as in feature pyramids (Lin et al., CVPR 2017).
        up = _doubled(self.from_sixteenth(deep)) + self.from_eighth(eighth)
        up = _doubled(self.join_eighth(up)) + self.from_quarter(quarter)
        features = self.join_quarter(up)
        inverse_depth = nn.functional.softplus(self.depth(features))
        return self._window(features, inverse_depth, deep.mean((2, 3))), inverse_depth

    def _window(self, features: Tensor, inverse_depth: Tensor, scene: Tensor) -> Tensor:
        seen = torch.cat((features, inverse_depth), 1)
        places = self.places.expand(len(seen), -1, -1, -1)
        looked = nn.functional.grid_sample(
            seen, places, mode="bilinear", padding_mode="border", align_corners=False
        )
        # (N, channels, 25, P) to the cell's own list, depth as what lies between.
        looked = torch.cat((looked[:, :-1], looked[:, -1:] - self.inverse_depth), 1)
        cells = self.look(looked.permute(0, 2, 3, 1).flatten(2))
        cells = cells + self.place + self.scene(scene)[:, None]
        cells = cells.transpose(1, 2).unflatten(2, (WINDOW, WINDOW))
        return self.answer(torch.cat((cells, self.neighbours(cells)), 1))
