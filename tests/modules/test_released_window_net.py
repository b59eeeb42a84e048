import pytest
import torch
from small import option

from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.modules.plain_window_net import PlainWindowNet
from avn.modules.released_window_net import ReleasedWindowNet
from avn.views.settings import CameraConfig


def test_released_option_is_the_released_network_layer_by_layer() -> None:
    with torch.device("meta"):
        net = build_object(
            "occupancy_model", option("occupancy_model", "released"), camera={"size": 128}
        ).net
    side = 128 - 6 - 6 - 4 - 4 + 3 * 6
    sizes = [
        *(3 * 32 * 49 + 32, 32 * 48 * 49 + 48, 48 * 64 * 25 + 64, 64 * 64 * 25 + 64),
        64 * 200 + 200,  # a dense layer of each pixel
        *(200 * 64 * 49 + 64, 64 * 32 * 49 + 32, 32 * 1 * 49 + 1),
        *(side * side * 4096 + 4096, 2 * 4096, 4096 * 1000 + 1000, 2 * 1000),
        1000 * 25 + 25,
    ]
    assert sum(own.numel() for own in net.parameters()) == sum(sizes)
    layers = [own for own in net.modules() if hasattr(own, "stride")]
    assert all(own.stride == (1, 1) for own in layers)
    assert all(own.padding == (0, 0) for own in layers)
    assert not [own for own in net.modules() if "Pool" in type(own).__name__]


def test_released_network_sees_views_of_any_size() -> None:
    net = ReleasedWindowNet(CameraConfig(size=24), hidden=(8, 6)).eval()
    log_odds, depth = net(torch.rand(2, 3, 24, 24))
    assert log_odds.shape == (2, 2, 5, 5)
    assert float(torch.sigmoid(log_odds[:, 1]).min()) == 1.0  # it is asked about all cells
    assert depth.shape == ()
    with pytest.raises(UserError, match=r"renderer.camera.size: 21; the network needs 22"):
        ReleasedWindowNet(CameraConfig(size=21))


def test_the_paper_s_network_is_plain_and_trained_with_the_mean_squared_error() -> None:
    model = build_object("occupancy_model", option("occupancy_model", "paper"), camera={"size": 32})
    model.training_loss.update = lambda *_: None
    pictures, free = torch.rand(6, 3, 32, 32), torch.rand(6, 5, 5).round()
    model.eval()  # without dropout
    loss = model.training_step({"pictures": pictures, "target": free}, 0)
    probability = torch.sigmoid(model.log_odds(pictures)[:, 0])
    assert float(loss) == pytest.approx(float(((probability - free) ** 2).mean()), rel=1e-5)
    views = (pictures * 255).byte().permute(0, 2, 3, 1)
    assert float(model(views)[:, 1].min()) == 1.0
    mirrored = model(views.flip(2))[:, 0].flip(-1)
    assert not torch.allclose(model(views)[:, 0], mirrored, atol=1e-3)  # no averaging


@pytest.mark.parametrize("changes", [{"widths": (0, 4)}, {"hidden": (0,)}, {"dropout": 1.0}])
def test_what_cannot_be_built_is_one_line(changes: dict) -> None:
    with pytest.raises(UserError, match=r"net: widths and hidden are 1 or more each, dropout"):
        PlainWindowNet(CameraConfig(size=32), **changes)
