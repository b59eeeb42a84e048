"""HRIR filters: what the two ears hear of plane waves."""

import numpy as np
import pytest
from scipy.signal import butter, correlate, resample_poly, sosfilt

from avn.acoustics.ambisonics import sh
from avn.acoustics.hrtf import load_sh_hrirs

RATE = 16000
FINE = 8
# Measured on the set itself: time difference below 1.5 kHz in microseconds (right ear first),
# level difference above 1.5 kHz in dB (right ear louder), as the duplex theory of hearing has it.
REFERENCE = {30: (273.0, 5.8), 60: (664.0, 11.6), 90: (734.0, 6.2)}


def ears(azimuth: float, heading: int = 0) -> np.ndarray:
    """Responses (2, taps) to a plane wave from a compass bearing in degrees."""
    bearing = np.radians(azimuth)
    harmonics = sh([np.sin(bearing), np.cos(bearing), 0.0])
    filters = load_sh_hrirs().filters(RATE)[heading].astype(np.float64)
    return np.einsum("ect,c->et", filters, harmonics)


def time_difference(response: np.ndarray) -> float:
    """Microseconds by which the right ear hears earlier, below 1.5 kHz."""
    low = sosfilt(butter(4, 1500, fs=RATE, output="sos"), np.pad(response, ((0, 0), (0, 400))))
    left, right = resample_poly(low, FINE, 1, axis=1)
    lag = int(np.argmax(correlate(left, right))) - (len(right) - 1)
    return lag / (FINE * RATE) * 1e6


def level_difference(response: np.ndarray) -> float:
    """Decibels by which the right ear hears louder, above 1.5 kHz."""
    power = np.abs(np.fft.rfft(response, 1024)) ** 2
    left, right = power[:, np.fft.rfftfreq(1024, 1 / RATE) >= 1500].sum(axis=1)
    return float(10 * np.log10(right / left))


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("azimuth", REFERENCE)
def test_time_and_level_differences_are_those_of_the_set(azimuth: int, side: int) -> None:
    response = ears(side * azimuth)
    time, level = REFERENCE[azimuth]
    assert side * time_difference(response) == pytest.approx(time, rel=0.05)
    assert side * level_difference(response) == pytest.approx(level, rel=0.05)


@pytest.mark.parametrize("azimuth", [0, 180])
def test_front_and_back_reach_both_ears_alike(azimuth: int) -> None:
    left, right = ears(azimuth)
    np.testing.assert_allclose(left, right, atol=1e-7)


@pytest.mark.parametrize("heading", range(4))
def test_an_agent_hears_in_front_what_lies_where_it_faces(heading: int) -> None:
    for relative in (0, 40, 90, 200):
        np.testing.assert_allclose(
            ears(90 * heading + relative, heading), ears(relative), atol=1e-6
        )


def test_a_plane_wave_from_the_front_has_unit_energy() -> None:
    assert (ears(0) ** 2).sum(axis=1).mean() == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize("rate", [8000, 48000])
def test_resampling_keeps_the_spectrum_and_its_level(rate: int) -> None:
    frequencies = np.arange(250, 2501 if rate < RATE else 5501, 250)
    responses = []
    for own in (RATE, rate):
        filters = load_sh_hrirs().filters(own)[0, 0].astype(np.float64)
        wave = np.exp(-2j * np.pi * np.outer(np.arange(filters.shape[-1]), frequencies) / own)
        responses.append(np.abs(filters @ wave))
    audible = responses[1] > 0.2
    ratio = responses[0][audible] / responses[1][audible]
    np.testing.assert_allclose(20 * np.log10(ratio), 0.0, atol=0.5 if rate < RATE else 0.2)


def test_a_turn_of_the_head_turns_the_sound_field_the_other_way() -> None:
    filters = load_sh_hrirs().filters(RATE)
    assert filters.dtype == np.float32
    for heading in range(4):
        # what comes from everywhere alike, and what differs between above and below (ACN 0, 2)
        np.testing.assert_allclose(filters[heading][:, [0, 2]], filters[0][:, [0, 2]], atol=1e-6)
    # the two horizontal dipoles (ACN 1 and 3) change their sign on turning round
    np.testing.assert_allclose(filters[2][:, [1, 3]], -filters[0][:, [1, 3]], atol=1e-6)
    # and each other's place, one of them its sign, on a quarter turn
    quarter, north = filters[1][:, [1, 3]], filters[0][:, [3, 1]]
    signs = np.sign((quarter * north).sum(axis=(0, 2)))
    assert signs.prod() == -1
    np.testing.assert_allclose(quarter, north * signs[:, None], atol=1e-6)


def test_no_tap_is_lost_in_resampling() -> None:
    fine, coarse = (load_sh_hrirs().filters(rate) for rate in (48000, RATE))
    assert fine.shape == (4, 2, 16, 256)
    assert coarse.shape == (4, 2, 16, -(-256 // 3))
    for filters in (fine, coarse):
        energy = (filters.astype(np.float64) ** 2).sum(axis=(0, 1, 2))
        assert energy[-len(energy) // 10 :].sum() < 1e-3 * energy.sum()  # it has died away
