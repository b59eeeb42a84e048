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
