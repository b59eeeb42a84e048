import pytest
import torch
from small import option

from avn.core.classes import build_object, build_part
from avn.core.errors import UserError
from avn.modules.released_sound_net import ReleasedSoundNet


def test_released_option_is_the_released_network_layer_by_layer() -> None:
    """Counts of Keras for its layers, whose moving means and variances PyTorch has as buffers."""
    node = option("sound_model", "released")
    with torch.device("meta"):
        net = build_part(node.net, channels=2, height=128, width=128, outputs=2)
    convolutions = [1_216, 73_856, 295_168, 1_180_160, 2_359_808]
    dense = [2_048 * 4_096 + 4_096, 4_096 * 1_000 + 1_000, 1_000 * 2 + 2]
    norms = [2 * width for width in (64, 128, 256, 512, 512, 4_096, 1_000)]
    assert sum(own.numel() for own in net.parameters()) == sum([*convolutions, *dense, *norms])
    names = [type(layer).__name__ for layer in net.layers]
    block = ["Conv2d", "ReLU", "MaxPool2d", "BatchNorm2d"]
    wide = ["Dropout", "Linear", "ReLU", "BatchNorm1d"]
    assert names == [*block * 5, "Flatten", *wide * 2, "Dropout", "Linear", "Tanh"]
    shares = [layer.p for layer in net.layers if isinstance(layer, torch.nn.Dropout)]
    assert shares == [0.25, 0.25, 0.4]
    layers = [own for own in net.layers if isinstance(own, torch.nn.Conv2d)]
    assert {(own.kernel_size, own.stride, own.padding) for own in layers} == {
        ((3, 3), (1, 1), (0, 0))
    }
    norm = next(own for own in net.layers if isinstance(own, torch.nn.BatchNorm2d))
    assert (norm.eps, norm.momentum) == (1e-3, 0.01)


def test_released_option_hears_the_power_of_mel_spectrograms() -> None:
    node = option("sound_model", "released")
    node.net.widths, node.net.hidden, node.net.dropout = [2, 2, 2, 2, 2], [4], [0.0, 0.0]
    model = build_object("sound_model", node, rate=16000).eval()
    clips = torch.randn(2, 2, 16000)
    pictures = model.spectrogram(clips)
    assert pictures.shape == (2, 2, 128, 128)
    assert torch.allclose(model.spectrogram(2 * clips), 4 * pictures, rtol=1e-4)
    assert model(1e3 * clips).abs().max() <= 10.0
    assert not model.flip_tta


@pytest.mark.parametrize("padding", [0, 1])
def test_hidden_and_answer_make_the_whole(padding: int) -> None:
    net = ReleasedSoundNet(2, 40, 33, (3, 4), (8, 6), (0.1, 0.2, 0.3), padding).eval()
    pictures = torch.rand(5, 2, 40, 33)
    hidden = net.hidden(pictures)
    assert hidden.shape == (5, net.hidden_size) == (5, 6)
    assert torch.equal(net.answer(hidden), net(pictures))


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"widths": (4, 0)}, "over 0"),
        ({"padding": -1}, "padding 0 or more"),
        ({"dropout": (0.1, 0.1)}, "one probability"),
        ({"dropout": (0.1, 0.1, 1.0)}, "0 to 1"),
        ({"widths": (4,) * 7}, "too small for 7 halvings"),
    ],
)
def test_what_cannot_be_built_is_one_line(changes: dict, line: str) -> None:
    with pytest.raises(UserError, match=line):
        ReleasedSoundNet(2, 64, 64, **changes)


@pytest.mark.parametrize("group", ["sound_model", "stop_model"])
def test_the_paper_s_network_has_five_convolutions_on_two_channels_and_no_mirror(
    group: str,
) -> None:
    model = build_object(group, option(group, "paper"), rate=16000).eval()
    convolutions = [own for own in model.net.modules() if isinstance(own, torch.nn.Conv2d)]
    assert len(convolutions) == 5
    assert convolutions[0].in_channels == 2
    assert not model.flip_tta
    assert not model.flip_augmentation
    clips = torch.randn(3, 2, 16000)
    pictures = model.spectrogram(clips)
    expected = model.net(pictures.contiguous(memory_format=torch.channels_last))
    assert torch.equal(model.estimate(pictures), expected)
