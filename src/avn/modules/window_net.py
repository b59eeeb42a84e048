"""Occupancy network that samples image features at the projections of the cells ahead."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor, nn

from avn.apartments.floor_plan import CELL
from avn.apartments.local_patch import WINDOW, window_offsets
from avn.core.errors import UserError
from avn.views.settings import CameraConfig

# Sampling points of a cell, in metres: right and front of its centre, height over the floor.
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


def probe_places(camera: CameraConfig) -> tuple[Tensor, Tensor]:
    """Project the sampling points of each cell of the local patch into the image.

    Parameters
    ----------
    camera : CameraConfig
        Height in metres, pitch and field of view in degrees.

    Returns
    -------
    places : (25, P, 2) float32 tensor
        Image coordinates right and down from the centre, -1 and 1 at the edges; clipped to -1..1.
    inverse_depth : (25, P) float32 tensor
        1 / metres along the optical axis.
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
    """U-shaped CNN that samples features at the projections of the local patch's cells.

    The pose of the camera relative to the agent is fixed, so each cell projects to a fixed place in
    the image. Features are sampled there (as in spatial transformers, Jaderberg et al., NeurIPS
    2015, with fixed sampling points), and all cells share the layers behind. The estimate of a
    cell so depends mostly on its own pixels, which generalises to other apartments. The network
    also estimates inverse depth and compares it with that of each cell.

    Parameters
    ----------
    camera : CameraConfig
        Camera of the views.
    widths : sequence of 4 int
        Channels at 1/2, 1/4, 1/8 and 1/16 of the image's resolution, 1 or more each.
    decoder : int
        Channels of the feature map at 1/4 resolution that is sampled, 1 or more.
    cell : int
        Channels of each cell, 1 or more.
    dropout : float
        Dropout probability of a cell's channels, 0 or more and less than 1.
    outputs : int
        Estimates of each cell, 1 or more; the network's own number is given.

    Raises
    ------
    UserError
        Where a parameter is out of range.
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
        outputs: int = 2,
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
        # Convolutions over the patch: walls continue, and near objects hide far cells.
        self.neighbours = nn.Sequential(_layer(cell, cell), _layer(cell, cell))
        self.answer = nn.Conv2d(2 * cell, outputs, 1)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Estimate log-odds of the cells and inverse depth in N pictures.

        Parameters
        ----------
        pictures : (N, 3, size, size) float32 tensor
            Normalised RGB.

        Returns
        -------
        log_odds : (N, outputs, 5, 5) float32 tensor
            Log-odds that each cell is free, that it is visible, and that it is part of a room.
        inverse_depth : (N, 1, size / 4, size / 4) float32 tensor
            1 / metres along the optical axis.
        """
        quarter = self.to_quarter(self.to_half(pictures))
        eighth = self.to_eighth(quarter)
        deep = self.to_sixteenth(eighth)
        # Top-down pathway as in feature pyramid networks (Lin et al., CVPR 2017).
        up = _doubled(self.from_sixteenth(deep)) + self.from_eighth(eighth)
        up = _doubled(self.join_eighth(up)) + self.from_quarter(quarter)
        features = self.join_quarter(up)
        inverse_depth = nn.functional.softplus(self.depth(features))
        return self._local_patch(features, inverse_depth, deep.mean((2, 3))), inverse_depth

    def _local_patch(self, features: Tensor, inverse_depth: Tensor, scene: Tensor) -> Tensor:
        seen = torch.cat((features, inverse_depth), 1)
        places = self.places.expand(len(seen), -1, -1, -1)
        looked = nn.functional.grid_sample(
            seen, places, mode="bilinear", padding_mode="border", align_corners=False
        )
        # (N, channels, 25, P); the last channel becomes estimated less projected inverse depth.
        looked = torch.cat((looked[:, :-1], looked[:, -1:] - self.inverse_depth), 1)
        cells = self.look(looked.permute(0, 2, 3, 1).flatten(2))
        cells = cells + self.place + self.scene(scene)[:, None]
        cells = cells.transpose(1, 2).unflatten(2, (WINDOW, WINDOW))
        return self.answer(torch.cat((cells, self.neighbours(cells)), 1))
