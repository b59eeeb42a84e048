"""Direction of arrival by cross-correlation on the head, against plane waves of known azimuth."""

import math

import numpy as np
import pytest
import torch
from small import option

from avn.acoustics.ambisonics import sh
from avn.acoustics.hrtf import load_sh_hrirs
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.heard import OTHERS, Arrivals
from avn.modules.srp_phat import SrpPhat

RATE = 16000
FRONT = list(range(-85, 90, 10))


def model(rate=RATE, **settings):
    return build_object("sound_model", option("sound_model", "srp_phat", **settings), rate=rate)


def burst(degrees, rate=RATE, noise=0.001):
    """Noise from some directions at both ears, clockwise from the front, (N, 2, rate)."""
    angle = np.radians(degrees)
    directions = np.stack((np.sin(angle), np.cos(angle), 0 * angle), -1)
    ears = np.einsum("ect,nc->net", load_sh_hrirs().filters(rate)[0], sh(directions))
    random = np.random.default_rng(0)
    dry = np.fft.rfft(random.standard_normal((len(directions), 1, rate)))
    wet = np.fft.irfft(np.fft.rfft(ears, rate) * dry, rate)
    wet += noise * random.standard_normal(wet.shape)
    return torch.from_numpy(wet).float()


def heard_degrees(found):
    """The likeliest direction, -180 to 180 degrees."""
    degrees = found.bearing.argmax(-1).numpy() * 360 / found.bins
    return (degrees + 180) % 360 - 180


def off(found, true):
    return np.abs((heard_degrees(found) - np.asarray(true) + 180) % 360 - 180)


@pytest.mark.parametrize("rate", [16000, 24000])
def test_a_burst_in_front_is_heard_where_it_is(rate):
    found = Arrivals(model(rate).arrival(burst(FRONT, rate)))
    assert (off(found, FRONT) <= 10).all()


def test_left_and_right_are_always_told_apart():
    degrees = [own for own in range(-175, 180, 10) if abs(own) % 180]
    found = heard_degrees(Arrivals(model().arrival(burst(degrees))))
    assert (np.sign(found) == np.sign(degrees)).all()


def test_levels_tell_front_from_back():
    behind = [100, 130, 160, -160, -130, -100]
    assert (off(Arrivals(model().arrival(burst(behind))), behind) <= 10).all()


def test_straight_ahead_and_straight_behind_are_alike_for_a_symmetric_head():
    for degrees in (0, 180):
        found = Arrivals(model().arrival(burst([degrees], noise=0.0))).bearing[0]
        assert float(found[0] - found[36]) == pytest.approx(0, abs=0.01)
        assert found.argmax() in (0, 36)


@pytest.mark.parametrize("level_weight", [0.0, 0.2])
def test_the_exchange_of_the_ears_mirrors_the_bearing(level_weight):
    clips = torch.cat((burst([20, 100, -60]), torch.randn(2, 2, RATE)))
    straight, other = (
        Arrivals(model(level_weight=level_weight).arrival(own)) for own in (clips, clips.flip(1))
    )
    mirrored = straight.bearing.flip(-1).roll(1, -1)
    assert torch.allclose(other.bearing, mirrored, atol=2e-3)
    assert torch.allclose(
        other.location[:3], straight.location[:3] * torch.tensor([-1.0, 1.0]), atol=1e-4
    )


def test_a_louder_clip_is_heard_alike_and_silence_is_even():
    clips = burst([40])
    one, many = (model().arrival(own) for own in (clips, 30 * clips))
    assert torch.allclose(one, many, atol=1e-3)
    silent = Arrivals(model().arrival(torch.zeros(1, 2, RATE)))
    assert torch.allclose(silent.bearing.exp(), torch.full((1, 72), 1 / 72), atol=1e-5)


def test_what_cannot_be_heard_is_left_open():
    found = Arrivals(model(metres=3.0, length_sigma=2.0).arrival(burst([90, 0])))
    assert found.values.shape == (2, 72 + OTHERS)
    assert torch.allclose(found.bearing.exp().sum(1), torch.ones(2), atol=1e-5)
    assert torch.allclose(found.distance, torch.tensor([math.log(3), 2.0]))
    assert (found.in_sight == 0).all()
    assert torch.allclose(found.location.norm(dim=1), torch.full((2,), 3.0), atol=1e-5)
    assert torch.allclose(found.location_sigma, torch.full((2,), 6.0))
    assert torch.equal(model()(burst([90])), Arrivals(model().arrival(burst([90]))).location)


def test_a_lower_temperature_is_surer():
    clips = burst([30], noise=0.5)
    sure, unsure = (
        Arrivals(model(temperature=own).arrival(clips)).bearing.max() for own in (0.05, 0.5)
    )
    assert sure > unsure


def test_bins_and_batches_do_not_matter():
    clips = burst(FRONT)
    assert (off(Arrivals(model(bins=180).arrival(clips)), FRONT) <= 10).all()
    alone = torch.cat([model().arrival(clip[None]) for clip in clips[:3]])
    assert torch.allclose(alone, model().arrival(clips)[:3], atol=1e-4)
    assert not list(SrpPhat().parameters())
    assert not SrpPhat().state_dict()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("bins", 30),
        ("high", 9000.0),
        ("low", -1.0),
        ("stft_window", 2.0),
        ("dynamic", 0.0),
        ("level_weight", -1.0),
        ("temperature", 0.0),
        ("metres", 0.0),
        ("length_sigma", 20.0),
    ],
)
def test_settings_out_of_range_are_refused(key, value):
    with pytest.raises(UserError, match=rf"sound_model\.{key}"):
        model(**{key: value})
