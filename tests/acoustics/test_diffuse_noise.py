"""Noise of a diffuse field: spectrum, level and coherence against the closed form."""

import numpy as np
import pytest
from scipy.signal import csd, welch

from avn.acoustics.diffuse_noise import EARS, diffuse_noise
from avn.acoustics.materials import SPEED_OF_SOUND

RATE = 16000


@pytest.fixture(scope="module")
def white():
    return np.random.default_rng(1).standard_normal(60 * RATE).astype(np.float32)


@pytest.mark.parametrize("distance", [EARS, 0.05])
def test_coherence_is_that_of_an_isotropic_field(white, distance):
    left, right = diffuse_noise(white, RATE, distance)
    settings = {"fs": RATE, "nperseg": 512}
    frequency, cross = csd(left, right, **settings)
    own = np.sqrt(welch(left, **settings)[1] * welch(right, **settings)[1])
    angle = 2 * np.pi * frequency[2:-2] * distance / SPEED_OF_SOUND
    np.testing.assert_allclose((cross / own)[2:-2].real, np.sin(angle) / angle, atol=0.06)
    assert np.abs((cross / own)[2:-2].imag).max() < 0.08, "neither ear is ahead"


def test_both_ears_have_the_level_and_the_spectrum_of_the_recording(white):
    tone = np.sin(2 * np.pi * 1000 * np.arange(len(white)) / RATE).astype(np.float32)
    both = diffuse_noise(0.1 * white + tone, RATE)
    np.testing.assert_allclose(np.sqrt((both**2).mean(1)), 1.0, rtol=1e-5)
    for ear in both:
        frequency, power = welch(ear, fs=RATE, nperseg=1024)
        assert abs(frequency[power.argmax()] - 1000) < 20


def repeated(white, times):
    return np.tile(white[: len(white) // times], times)


@pytest.mark.parametrize("times", [1, 2, 3, 4])
def test_a_recording_that_repeats_is_diffuse_as_well(white, times):
    left, right = diffuse_noise(repeated(white, times), RATE)
    settings = {"fs": RATE, "nperseg": 512}
    frequency, cross = csd(left, right, **settings)
    powers = np.stack([welch(ear, **settings)[1] for ear in (left, right)])[:, 2:-2]
    angle = 2 * np.pi * frequency[2:-2] * EARS / SPEED_OF_SOUND
    coherence = cross[2:-2].real / np.sqrt(powers.prod(0))
    np.testing.assert_allclose(coherence, np.sin(angle) / angle, atol=0.15)
    assert np.abs(10 * np.log10(powers[0] / powers[1])).max() < 1, "as loud at both ears"


def test_a_click_stays_finite():
    click = np.zeros(2 * RATE, np.float32)
    click[100] = 1
    assert np.isfinite(diffuse_noise(click, RATE)).all()


def test_a_hum_is_as_loud_at_both_ears():
    time = np.arange(3 * RATE) / RATE
    hum = sum(np.sin(2 * np.pi * 100 * k * time) / k for k in (1, 2, 4, 8, 16, 32))
    ears = np.abs(np.fft.rfft(diffuse_noise(hum.astype(np.float32), RATE)))
    tones = ears[:, [300 * k for k in (1, 2, 4, 8, 16, 32)]]
    assert np.abs(20 * np.log10(tones[0] / tones[1])).max() < 0.5
