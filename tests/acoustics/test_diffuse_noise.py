"""Noise of a diffuse field: spectrum, level and coherence against the closed form."""

import numpy as np
import pytest
from scipy.signal import csd, hilbert, welch

from avn.acoustics.diffuse_noise import EARS, diffuse_noise, independent_shift
from avn.acoustics.dry_sounds import load_sounds
from avn.acoustics.materials import SPEED_OF_SOUND

RATE = 16000


@pytest.fixture(scope="module")
def white():
    return np.random.default_rng(1).standard_normal(20 * RATE).astype(np.float32)


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


def octave_levels(wave):
    power = np.abs(np.fft.rfft(wave)) ** 2
    frequency = np.fft.rfftfreq(len(wave), 1 / RATE)
    edges = 62.5 * 2.0 ** np.arange(8)
    return 10 * np.log10(
        [power[(frequency >= low) & (frequency < 2 * low)].sum() for low in edges[:-1]]
    )


@pytest.mark.parametrize("name", ["water_running", "appliance_mixer", "appliance_vacuum"])
def test_each_ear_has_the_octaves_of_the_recording(name):
    wave = load_sounds({name: name}, RATE)[name]
    wanted = octave_levels(wave / np.sqrt(np.mean(wave**2)))
    for ear in diffuse_noise(wave, RATE):
        np.testing.assert_allclose(octave_levels(ear), wanted, atol=0.3)


@pytest.mark.parametrize("count", [2, 3, 9, 4001])
def test_a_tone_that_cancels_stays_finite(count):
    # nothing is left of it in the sum or in the difference
    wave = np.cos(np.pi * np.arange(count)).astype(np.float32)
    assert np.isfinite(diffuse_noise(wave, 2000, 0.1715)).all()


def test_the_shift_of_a_tone_is_a_quarter_of_its_period_off():
    # its sum and its difference with itself are as loud
    tone = np.sin(2 * np.pi * 440 * np.arange(2 * RATE) / RATE)
    found = independent_shift(tone, RATE)
    assert RATE // 2 <= found <= RATE
    assert abs(np.corrcoef(tone, np.roll(tone, found))[0, 1]) < 0.05


def test_the_shift_of_a_narrow_band_has_the_least_coherence(white):
    band = np.fft.rfft(white[: 2 * RATE])
    frequency = np.fft.rfftfreq(2 * RATE, 1 / RATE)
    band[np.abs(frequency - 1400) > 2] = 0
    wave = np.tile(np.fft.irfft(band, 2 * RATE), 2)
    one, other = hilbert(wave), hilbert(np.roll(wave, independent_shift(wave, RATE)))
    coherence = np.abs(np.vdot(one, other)) / np.linalg.norm(one) / np.linalg.norm(other)
    assert coherence < 0.1


def test_a_hum_is_as_loud_at_both_ears():
    time = np.arange(3 * RATE) / RATE
    hum = sum(np.sin(2 * np.pi * 100 * k * time) / k for k in (1, 2, 4, 8, 16, 32))
    ears = np.abs(np.fft.rfft(diffuse_noise(hum.astype(np.float32), RATE)))
    tones = ears[:, [300 * k for k in (1, 2, 4, 8, 16, 32)]]
    assert np.abs(20 * np.log10(tones[0] / tones[1])).max() < 0.5
