import math

import pytest
import torch

from avn.modules.power_spectrogram import PowerSpectrogram
from avn.modules.spectrogram import Spectrogram


def test_the_power_of_a_tone_is_that_of_its_transform() -> None:
    """A tone of amplitude a at a bin's centre: |a sum(window) / 2|^2 there, a quarter beside it."""
    rate, window, amplitude = 16000, 512, 0.1
    time = torch.arange(rate) / rate
    tone = amplitude * torch.sin(2 * math.pi * 2000.0 * time)
    power = PowerSpectrogram(rate, bands=256, frames=50)
    picture = power(torch.stack((tone, 2 * tone))[None])[0]
    peak = (amplitude * window / 2 / 2) ** 2
    # the mean over the triangle of a band, whose sides are a bin wide or a little more
    assert float(picture[0].sum(0).mean()) == pytest.approx(peak * 1.5, rel=0.05)
    assert torch.allclose(picture[1], 4 * picture[0], rtol=1e-4)


def test_it_is_the_log_spectrogram_without_logarithm() -> None:
    clips = torch.randn(3, 2, 8000)
    log = Spectrogram(8000, bands=32, frames=40, interaural=False)(clips)
    power = PowerSpectrogram(8000, bands=32, frames=40)
    linear = power(clips)
    assert power.channels == 2
    ratio = linear / 10 ** (log - 4.0)
    assert torch.allclose(ratio, ratio[0, 0, 0, 0].expand_as(ratio), rtol=1e-3)
    assert torch.equal(power.mirror(linear), linear.flip(1))
    logarithm = PowerSpectrogram(8000, bands=32, frames=40, log=True)(clips)
    assert torch.allclose(logarithm, torch.log10(linear), atol=1e-4)
