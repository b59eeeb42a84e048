from pathlib import Path
from typing import Any

import pytest
import torch
from omegaconf import DictConfig
from small import option

from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.modules.audio_network import PictureBatch
from avn.modules.five_layer_cnn import FiveLayerCnn
from avn.modules.sound_cnn import SoundCnn

CONF = Path(__file__).parents[2] / "conf" / "sound_model"


def config(name: str = "cnn5", **changes: Any) -> DictConfig:
    return option("sound_model", name, **changes)


def build(name: str = "cnn5", **changes: Any) -> SoundCnn:
    return build_object("sound_model", config(name, **changes))


@pytest.fixture
def clips() -> torch.Tensor:
    return torch.randn(4, 2, 16000, generator=torch.Generator().manual_seed(0)) * 0.1


def test_option_names_are_those_of_the_files() -> None:
    for path in CONF.glob("*.yaml"):
        assert config(path.stem).name == path.stem


def test_misspelt_key_is_refused() -> None:
    with pytest.raises(Exception, match="dropuot"):
        config(net__dropuot=0.5)


def test_default_net_hears_metres(clips: torch.Tensor) -> None:
    model = build().eval()
    assert model(clips).shape == (4, 2)
    assert sum(isinstance(layer, torch.nn.Conv2d) for layer in model.net.modules()) == 5


def test_odd_pictures_fit() -> None:
    torch.manual_seed(0)
    net = FiveLayerCnn(4, 50, 33, widths=(4, 4, 4, 4, 8), hidden=(8,)).eval()
    pictures = torch.randn(8, 4, 50, 33, requires_grad=True)
    answer = net(pictures)
    assert answer.shape == (8, 2)
    answer.abs().sum().backward()
    heard = pictures.grad.abs().sum(dim=(0, 1)) > 0
    # every band and frame but those that no longer fill a step of the last layers
    assert heard[:32, :32].float().mean() > 0.9
    assert bool(heard.any(dim=1)[:32].all())
    assert bool(heard.any(dim=0)[:32].all())


def test_exchanged_ears_mirror_the_location(clips: torch.Tensor) -> None:
    model = build(flip_tta=True).eval()
    straight, mirrored = model(clips), model(clips.flip(1))
    torch.testing.assert_close(mirrored, straight * torch.tensor((-1.0, 1.0)), atol=1e-4, rtol=0)
    assert straight[:, 0].abs().max() > 1e-3


def test_a_batch_is_learned(clips: torch.Tensor) -> None:
    node = config(
        spectrogram__bands=16, spectrogram__frames=16, net__widths=[8] * 5, net__dropout=0.0
    )
    torch.manual_seed(0)
    model = build_object("sound_model", node).train()
    optimizer = torch.optim.Adam(model.parameters(), 1e-2)
    target = torch.tensor([[3.0, 1.0], [-2.0, 4.0], [0.5, -3.0], [-1.0, -1.0]])
    nothing = torch.zeros(4, dtype=torch.int64)
    pictures = model.spectrogram(clips)
    batch = PictureBatch(pictures=pictures, target=target, in_sight=nothing.bool(), sound=nothing)
    losses = []
    for _ in range(80):
        optimizer.zero_grad()
        loss = model.training_step(batch, 0)
        loss.backward()
        optimizer.step()
        losses.append(float(loss.detach()))
    assert min(losses[-10:]) < 0.1 * losses[0]


def test_train_seed_draws_the_weights() -> None:
    def first(seed: int) -> torch.Tensor:
        return next(build(train_seed=seed).net.layers[1].parameters())

    before = torch.get_rng_state()
    assert torch.equal(first(1), first(1))
    assert not torch.equal(first(1), first(2))
    assert torch.equal(before, torch.get_rng_state())


def test_hyperparameters_are_plain() -> None:
    hparams = dict(build().hparams)
    assert type(hparams["net"]) is dict
    assert type(hparams["net"]["widths"]) is list


def test_every_recipe_key_reaches_the_model() -> None:
    assert set(build().hparams) - {"rate"} == set(config()) - {"_target_", "ckpt_path"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"schedule": "linear"}, "sound_model.schedule is 'linear'"),
        ({"epochs": 0}, "sound_model.epochs is 0"),
        ({"spectrogram__frames": 60}, "sound_model.spectrogram.frames is 60"),
    ],
)
def test_bad_option_is_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        build(**changes)
