"""Clips of sources that begin and end: a convolution in time, with the reverberant tail."""

import numpy as np
import pytest
import torch

from avn.acoustics.clips import ClipRenderer, DrySounds, brir_spectra
from avn.acoustics.dry_sounds import RATE
from avn.acoustics.microphone import Microphone
from avn.core.clip_id import ClipId

QUIET = Microphone(noise_rms=0.0)
TAPS = 9600


@pytest.fixture(scope="module")
def renderer():
    wave = np.random.default_rng(0).standard_normal(3 * RATE).astype(np.float32)
    return ClipRenderer(DrySounds({"hiss": wave}), QUIET, 3, "eval")


@pytest.fixture(scope="module")
def brirs():
    decay = np.exp(-np.arange(TAPS) / 2000)
    noise = np.random.default_rng(1).standard_normal((1, 2, TAPS)) * decay
    return torch.from_numpy(noise.astype(np.float32))


def clip():
    return ClipId(*(torch.tensor([value]) for value in (1, 2, 0, 3)))


def switched(renderer, brirs, begin, end):
    ends = (torch.tensor([value], dtype=torch.float64) for value in (begin, end))
    return renderer.between(brirs, clip(), *ends)[0].numpy()


def dry(renderer):
    """The second that the clip repeats."""
    impulse = torch.zeros(1, 2, 10)
    impulse[..., 0] = 1
    return renderer.at_ears(brir_spectra(impulse), clip())[0, 0].numpy()


@pytest.mark.parametrize(
    ("begin", "end"), [(-0.3, 9.0), (0.25, 0.5), (-9.0, 0.1), (-9.0, -0.2), (-0.75, -0.5)]
)
def test_it_is_the_convolution_of_the_switched_sound(renderer, brirs, begin, end):
    times = np.arange(-RATE, RATE) / RATE
    emitted = np.tile(dry(renderer), 2) * ((times >= begin) & (times < end))
    for ear in range(2):
        expected = np.convolve(emitted, brirs[0, ear].numpy())[RATE : 2 * RATE]
        np.testing.assert_allclose(
            switched(renderer, brirs, begin, end)[ear], expected, atol=1e-3 * expected.std() + 1e-6
        )


def test_one_that_always_sounds_is_the_steady_clip(renderer, brirs):
    steady = renderer.at_ears(brir_spectra(brirs), clip())[0].numpy()
    np.testing.assert_allclose(
        switched(renderer, brirs, -np.inf, np.inf), steady, atol=1e-4 * steady.std()
    )


def test_the_first_silent_second_has_the_tail_and_the_next_is_silent(renderer, brirs):
    tail = switched(renderer, brirs, -np.inf, 0.0)
    power = (tail.reshape(2, 10, -1) ** 2).mean((0, 2))
    assert power[0] > 0
    # the tail falls as the response: amplitude by 16000 / 2000 = 8 nepers a second
    slope = np.polyfit(np.arange(5) * 0.1, np.log(power[:5]), 1)[0]
    assert abs(slope + 16) < 1.5
    assert np.abs(tail[:, TAPS:]).max() < 1e-4 * np.abs(tail).max()
    assert np.abs(switched(renderer, brirs, -np.inf, -1.0)).max() < 1e-4 * np.abs(tail).max()


def test_what_is_heard_before_and_after_a_switch_adds_up(renderer, brirs):
    steady = renderer.at_ears(brir_spectra(brirs), clip())[0].numpy()
    parts = [switched(renderer, brirs, *ends) for ends in ((-np.inf, 0.3), (0.3, np.inf))]
    np.testing.assert_allclose(sum(parts), steady, atol=1e-4 * steady.std())
