import math

import pytest
import torch
from small import option

from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.heard import OTHERS, Arrivals, bearing_label

RATE = 16000


def network(**settings):
    torch.manual_seed(0)
    net = {"_target_": "avn.modules.five_layer_cnn.FiveLayerCnn", "output_scale": 1.0}
    net |= {"widths": [4, 4, 4, 4, 4], "hidden": [16], "dropout": 0.0}
    config = option("sound_model", "arrival", net=net, **settings)
    return build_object("sound_model", config, rate=RATE)


def targets(degrees, metres=3.0):
    angle = torch.deg2rad(torch.as_tensor(degrees, dtype=torch.float32))
    right, front = angle.sin(), angle.cos()
    log = torch.full_like(angle, math.log(metres))
    return torch.stack((right, front, log, metres * right, metres * front), 1)


def label_of(model, target):
    return bearing_label(target[:, :2], model.bins, model.spread)


def test_the_heads_have_their_meaning():
    model = network().eval()
    heard = Arrivals(model.arrival(torch.randn(3, 2, RATE)))
    assert heard.values.shape == (3, 72 + OTHERS)
    assert torch.allclose(heard.bearing.exp().sum(1), torch.ones(3), atol=1e-5)
    assert (heard.distance[:, 1] > 0).all()
    assert (heard.location_sigma > 0).all()
    assert torch.equal(model(torch.zeros(2, 2, RATE)).isfinite(), torch.ones(2, 2).bool())


def test_a_mirrored_clip_is_heard_from_the_other_side():
    model, clips = network().eval(), torch.randn(4, 2, RATE)
    straight, mirrored = model.arrival(clips), model.arrival(clips.flip(1))
    swapped = model.answer(model.mirror_outputs(model.estimate(model.spectrogram(clips))))
    assert torch.allclose(mirrored, swapped, atol=1e-4)
    bearing = Arrivals(straight).bearing
    assert torch.allclose(Arrivals(mirrored).bearing[:, 1:], bearing[:, 1:].flip(1), atol=1e-4)
    assert torch.allclose(Arrivals(mirrored).location[:, 0], -Arrivals(straight).location[:, 0])


@pytest.mark.parametrize("degrees", [0.0, 5.0, 90.0, 222.5, 359.0])
def test_labels_lie_around_the_direction(degrees):
    model = network()
    label = label_of(model, targets([degrees]))[0]
    assert label.sum() == pytest.approx(1, abs=1e-5)
    centres = torch.arange(72) * 5.0
    away = (centres - degrees + 180) % 360 - 180
    assert abs(float((label * away).sum())) < 0.5
    assert float((label * away.square()).sum().sqrt()) == pytest.approx(5, rel=0.1)
    other = label_of(model, model.mirror_targets(targets([degrees])))[0]
    assert torch.allclose(other[1:], label[1:].flip(0), atol=1e-5)


def test_a_source_above_has_no_direction():
    none = torch.tensor([[0.0, 0.0, 0.5, 0.0, 0.0]])
    assert torch.allclose(label_of(network(), none), torch.full((1, 72), 1 / 72))


def test_the_loss_is_least_for_the_truth():
    model, target = network(), targets([30.0, 200.0])
    sight = torch.tensor([True, False])

    def loss(degrees, metres, logit):
        raw = torch.zeros(2, 72 + OTHERS)
        other = targets(degrees, metres)
        raw[:, :72] = label_of(model, other).clamp_min(1e-9).log()
        raw[:, 72], raw[:, 73] = other[:, 2], -1.0
        raw[:, 74] = torch.where(sight, logit, -logit)
        raw[:, 75:77] = other[:, 3:] / 5.0
        return float(model.loss(raw, target, sight))

    best = loss([30.0, 200.0], 3.0, 4.0)
    assert best < loss([60.0, 200.0], 3.0, 4.0)
    assert best < loss([30.0, 200.0], 5.0, 4.0)
    assert best < loss([30.0, 200.0], 3.0, -4.0)


@pytest.mark.parametrize(("metres", "weight"), [(0.5, 8.0), (1.5, 4.0), (3.0, 1.0), (6.0, 1.0)])
def test_errors_of_near_lengths_count_as_often_as_those_of_far_ones(metres, weight):
    # pairs grow with the square of the length: one of 1.5 m stands for four
    target, sight = torch.cat((targets([0.0], metres), targets([0.0], 6.0))), torch.ones(2).bool()

    def loss(near, far, model):
        raw = torch.zeros(2, 72 + OTHERS)
        raw[:, 72] = target[:, 2] + torch.tensor([near, far])
        return float(model.loss(raw, target, sight))

    for model, factor in ((network(), weight), (network(near_weight=1.0), 1.0)):
        exact = loss(0.0, 0.0, model)
        grown = loss(0.2, 0.0, model) - exact, loss(0.0, 0.2, model) - exact
        assert grown[0] / grown[1] == pytest.approx(factor, rel=1e-3)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("bins", 30),
        ("bins", 256),
        ("spread", 0.0),
        ("near_below", 0.0),
        ("near_weight", 0.5),
        ("near_weight", math.nan),
    ],
)
def test_settings_out_of_range_are_refused(key, value):
    with pytest.raises(UserError, match=f"sound_model.{key}"):
        network(**{key: value})
