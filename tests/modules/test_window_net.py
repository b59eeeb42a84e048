import numpy as np
import pytest
import torch

from avn.apartments.floor_plan import CELL
from avn.apartments.local_patch import window_offsets
from avn.core.errors import UserError
from avn.modules.window_net import PROBES, WindowNet, probe_places
from avn.views.camera import ray_directions
from avn.views.settings import CameraConfig


def test_probes_lie_in_the_pixels_whose_rays_meet_them() -> None:
    camera, size = CameraConfig(), 128
    places, inverse_depth = probe_places(camera)
    cells = window_offsets().reshape(-1, 2) * CELL
    rays = ray_directions(camera, 0, size)[:, :, 0]
    checked = 0
    for cell, (right, front) in enumerate(cells):
        for probe, (aside, ahead, up) in enumerate(PROBES):
            x, y = (float(v) for v in places[cell, probe])
            if max(abs(x), abs(y)) > 0.98:
                continue  # held to the edge
            column, row = int((x + 1) / 2 * size), int((y + 1) / 2 * size)
            point = np.array((right + aside, front + ahead, up - camera.height))
            # Facing north, east is right. The pixel's ray and the probe agree to a pixel's width.
            away = np.degrees(np.arccos(rays[row, column] @ point / np.linalg.norm(point)))
            assert away < 1.0
            axis = np.array((0, np.cos(np.radians(camera.pitch)), np.sin(np.radians(camera.pitch))))
            assert float(inverse_depth[cell, probe]) == pytest.approx(1 / (axis @ point), rel=1e-4)
            checked += 1
    assert checked > 150


def test_every_cell_is_looked_at_by_some_probe() -> None:
    places, _ = probe_places(CameraConfig())
    inside = (places.abs() < 1).all(-1).any(1)
    assert inside.all()


def test_a_cell_is_judged_by_what_is_seen_of_it() -> None:
    torch.manual_seed(0)
    net = WindowNet(CameraConfig(), widths=(4, 8, 8, 8), decoder=8, cell=8).eval()
    picture = torch.rand(1, 3, 128, 128, requires_grad=True)
    log_odds, depth = net(picture)
    assert log_odds.shape == (1, 2, 5, 5)
    assert depth.shape == (1, 1, 32, 32)
    assert (depth > 0).all()
    # The nearest cell in the middle lies at the bottom of the picture, the farthest higher up.
    places, _ = probe_places(CameraConfig())
    for row in (0, 4):
        (own,) = torch.autograd.grad(log_odds[0, 0, row, 2], picture, retain_graph=True)
        weight = own.abs().sum((0, 1, 3))
        centre = float((weight * torch.linspace(-1, 1, 128)).sum() / weight.sum())
        assert abs(centre - float(places[5 * row + 2, :, 1].mean())) < 0.35


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"widths": (4, 8)}, "net: widths are four"), ({"dropout": 1.0}, r"net\.dropout is 1\.0")],
)
def test_bad_size_is_named(changes: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        WindowNet(CameraConfig(), **changes)
