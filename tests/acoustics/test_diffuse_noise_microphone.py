"""Noise of the surroundings at a known ratio, random levels, and errors."""

import numpy as np
import pytest
import torch

from avn.acoustics.clips import ClipRenderer, DrySounds, brir_spectra
from avn.acoustics.diffuse_noise_microphone import DiffuseNoiseMicrophone
from avn.acoustics.microphone import Microphone
from avn.core.clip_id import ClipId
from avn.core.errors import UserError

RATE, COUNT = 16000, 64


@pytest.fixture(scope="module")
def bank():
    wave = np.random.default_rng(0).standard_normal(3 * RATE).astype(np.float32)
    return DrySounds({"hiss": wave})


def clips(bank, microphone, first=0):
    brir = torch.zeros(1, 2, 100)
    brir[..., 0] = torch.tensor([0.2, 0.1])
    zeros = torch.zeros(COUNT, dtype=torch.int64)
    clip = ClipId(zeros, zeros, zeros, first + torch.arange(COUNT))
    return ClipRenderer(bank, microphone, 3, "eval").render(brir_spectra(brir), clip, zeros)


def decibels(ratio):
    return 10 * torch.log10(ratio)


@pytest.mark.parametrize("noises", [["white"], ["appliance_hood", "water_running"]])
@pytest.mark.parametrize("snr", [20.0, 0.0])
def test_the_ratio_is_that_of_the_powers_of_the_clip(bank, noises, snr):
    dry = clips(bank, Microphone(noise_rms=0.0))
    noisy = DiffuseNoiseMicrophone(snr=(snr, snr), noises=noises, noise_rms=0.0)
    noise = clips(bank, noisy) - dry
    found = decibels(dry.square().mean((1, 2)) / noise.square().mean((1, 2)))
    assert abs(float(found.mean()) - snr) < 0.5
    # both ears are in the same field, although one is nearer to the source
    ears = decibels(noise[:, 0].square().mean() / noise[:, 1].square().mean())
    assert abs(float(ears)) < 0.5


def test_levels_and_ratios_are_spread_evenly_and_belong_to_the_clip(bank):
    quiet = {"noise_rms": 0.0}
    varied = DiffuseNoiseMicrophone(level=(-12, 12), snr=(200, 200), **quiet)
    level = decibels(
        clips(bank, varied).square().mean((1, 2))
        / clips(bank, Microphone(**quiet)).square().mean((1, 2))
    )
    assert float(level.min()) > -12.01
    assert float(level.max()) < 12.01
    assert abs(float(level.std()) - 24 / 12**0.5) < 1.2, "uniform over 24 dB"
    some = DiffuseNoiseMicrophone(level=(-12, 12), snr=(0, 40), noises=["white", "appliance_hood"])
    assert torch.equal(clips(bank, some), clips(bank, some))
    shifted = clips(bank, some, first=COUNT // 2)
    torch.testing.assert_close(clips(bank, some)[COUNT // 2 :], shifted[: COUNT // 2])


def test_a_share_of_the_clips_is_the_noise_alone(bank):
    ratio = {"snr": (10, 10), "noise_rms": 0.0}
    both = [DiffuseNoiseMicrophone(silent=share, **ratio) for share in (0.0, 0.25)]
    whole, some = (torch.cat([clips(bank, own, COUNT * k) for k in range(8)]) for own in both)
    same = (whole == some).all(-1).all(-1)
    assert abs(float((~same).float().mean()) - 0.25) < 4 * (0.25 * 0.75 / len(whole)) ** 0.5
    ratio = decibels(some[~same].square().mean((1, 2)) / whole[~same].square().mean((1, 2)))
    assert abs(float(ratio.mean()) + 10 * np.log10(11)) < 0.5, "noise, without ten times its power"


def test_the_noise_of_a_clip_has_no_seam(bank):
    low = DiffuseNoiseMicrophone(snr=(0, 0), noises=["appliance_furnace"], noise_rms=0.0)
    noise = clips(bank, low) - clips(bank, Microphone(noise_rms=0.0))
    steps = (noise - noise.roll(1, -1)).abs()
    assert float(steps[..., 0].mean()) < 2 * float(steps.mean())


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"level": (6, -6)}, "microphone.level"),
        ({"snr": (10,)}, "microphone.snr"),
        ({"snr": (float("nan"), 0)}, "microphone.snr"),
        ({"noises": ()}, "microphone.noises"),
        ({"noises": ("hum.wav",)}, "hum.wav"),
        ({"noise_rms": -1}, "microphone.noise_rms"),
        ({"silent": 1.5}, "microphone.silent"),
    ],
)
def test_what_cannot_work_is_named(given, named):
    with pytest.raises(UserError, match=named):
        DiffuseNoiseMicrophone(**given)
