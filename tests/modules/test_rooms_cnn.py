"""The occupancy network that tells furniture from walls."""

from __future__ import annotations

import torch
from synthetic_views import synthetic_views

from avn.datamodules.views import ViewSet
from avn.modules.occupancy_cnn import OccupancyCnn
from avn.modules.rooms_cnn import RoomsCnn

SMALL = {
    "_target_": "avn.modules.window_net.WindowNet",
    "widths": (4, 4, 4, 4),
    "decoder": 4,
    "cell": 8,
    "dropout": 0.0,
}


def test_it_estimates_rooms_besides_what_others_estimate() -> None:
    views = torch.from_numpy(synthetic_views(3, 0).rgb[0])
    found = RoomsCnn(name="rooms", net=SMALL)(views)
    assert found.shape == (3, 3, 5, 5)
    assert OccupancyCnn(name="small", net=SMALL)(views).shape == (3, 2, 5, 5)
    assert ((found > 0) & (found < 1)).all()


def test_it_learns_what_is_part_of_a_room() -> None:
    model = RoomsCnn(name="rooms", net=SMALL, depth_weight=0.0)
    batch = ViewSet([synthetic_views(64, 1)]).__getitems__(list(range(64)))
    batch["rooms"] = 1 - batch["target"]  # the opposite of free, so that no channel is the other
    optimizer = torch.optim.Adam(model.parameters(), lr=1e-2)
    for _ in range(150):
        optimizer.zero_grad()
        model.training_step(batch, 0).backward()
        optimizer.step()
    free, _, rooms = model.log_odds(batch["pictures"]).sigmoid().unbind(1)
    assert (free.round() == batch["target"]).float().mean() > 0.85
    assert (rooms.round() == batch["rooms"]).float().mean() > 0.85


def test_its_estimates_are_calibrated_and_scored() -> None:
    model = RoomsCnn(name="rooms", net=SMALL)
    model.log_dict = lambda values: None  # type: ignore[method-assign, assignment]
    views = ViewSet([synthetic_views(32, 2)])
    for subset in (0, 1):
        model.validation_step(views.__getitems__(list(range(32))), 0, subset)
    model.on_validation_epoch_end()
    assert model.calibration.shape == (3, 2)
    assert not torch.equal(model.calibration[2], torch.tensor((1.0, 0.0)))
    assert 0 <= model.measured["auc/validation/rooms"] <= 1
