"""Absorption by air: the standard's constants, and both parts of a response against exp(-m d)."""

import dataclasses
from math import exp

import numpy as np
import pytest
from numpy.typing import NDArray

from avn.acoustics.brir import render_direct_paths
from avn.acoustics.direct_path import band_energies, find_paths
from avn.acoustics.materials import BANDS, air_attenuation
from avn.acoustics.settings import AcousticsConfig
from avn.acoustics.tracer import trace
from avn.apartments.surfaces import shoebox

RESONANCE = AcousticsConfig()
DIFFRACTION = AcousticsConfig(name="diffraction", direct_path="diffraction")
# A long screen, and a path of about 80 m past its end; in the open it is straight.
SCREEN = np.array([[-60.0, -0.05, 1.0, 0.05]])
SOURCE, RECEIVERS = np.array([-3.0, -40.0, 1.0]), np.array([[-3.0, 40.0, 1.5], [8.0, 30.0, 1.5]])


def standard(frequency: float, celsius: float, humidity: float) -> float:
    """Decibel a metre by ISO 9613-1:1993, (3) to (5) and (B.3), at one atmosphere, term by term."""
    t, t_0, t_01 = celsius + 273.15, 293.15, 273.16
    h = humidity * 10 ** (-6.8346 * (t_01 / t) ** 1.261 + 4.6151)
    f_o = 24 + 4.04e4 * h * (0.02 + h) / (0.391 + h)
    f_n = (t / t_0) ** (-1 / 2) * (9 + 280 * h * exp(-4.170 * ((t / t_0) ** (-1 / 3) - 1)))
    classical = 1.84e-11 * (t / t_0) ** (1 / 2)
    oxygen = 0.01275 * exp(-2239.1 / t) / (f_o + frequency**2 / f_o)
    nitrogen = 0.1068 * exp(-3352.0 / t) / (f_n + frequency**2 / f_n)
    return 8.686 * frequency**2 * (classical + (t / t_0) ** (-5 / 2) * (oxygen + nitrogen))


@pytest.mark.parametrize(("celsius", "humidity"), [(20.0, 50.0), (10.0, 70.0), (30.0, 20.0)])
def test_the_constants_are_those_of_the_formula_of_the_standard(
    celsius: float, humidity: float
) -> None:
    wanted = [standard(band, celsius, humidity) * np.log(10) / 10 for band in BANDS]
    assert air_attenuation(BANDS, celsius, humidity) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize(
    ("celsius", "humidity", "decibel"),
    [
        (10.0, 70.0, [0.4, 1.0, 1.9, 3.7, 9.7, 32.8]),
        (20.0, 70.0, [0.3, 1.1, 2.8, 5.0, 9.0, 22.9]),
        (15.0, 20.0, [0.6, 1.2, 2.7, 8.2, 28.2, 88.8]),
        (15.0, 50.0, [0.5, 1.2, 2.2, 4.2, 10.8, 36.2]),
    ],
)
def test_the_attenuation_is_that_of_the_printed_table(
    celsius: float, humidity: float, decibel: list[float]
) -> None:
    """ISO 9613-2:1996, table 2: dB a kilometre, rounded to a tenth."""
    found = air_attenuation(BANDS, celsius, humidity) * 10 / np.log(10) * 1000
    assert found == pytest.approx(decibel, rel=0.01, abs=0.06)


@pytest.mark.parametrize("config", [RESONANCE, DIFFRACTION], ids=lambda own: own.name)
def test_air_takes_its_part_of_the_direct_sound_over_the_length_of_the_path(
    config: AcousticsConfig,
) -> None:
    paths = find_paths(config.direct_path, SCREEN, SOURCE, RECEIVERS)
    assert paths.bent.any() == (config is DIFFRACTION)
    wanted = np.exp(-air_attenuation() * paths.length[:, None])
    assert wanted[:, -1].max() < 0.7
    assert band_energies(paths) / band_energies(paths, air=False) == pytest.approx(wanted)
    without = dataclasses.replace(config, air=False)
    spectra = []
    for own in (config, without):
        heard = render_direct_paths(SCREEN, SOURCE, RECEIVERS, own)
        samples = heard.samples * heard.scale[:, None, None, None].astype(np.float64)
        spectra.append(np.abs(np.fft.rfft(samples, own.rate, axis=-1))[..., list(BANDS)])
    power = (np.stack(spectra) ** 2).sum(axis=(2, 3))  # headings and ears
    assert decibel(power[0] / power[1]) == pytest.approx(decibel(wanted), abs=0.1)


def test_air_takes_the_same_part_of_a_reflection() -> None:
    """Each event has its own length."""
    receivers = np.array([[6.0, 3.0, 1.5], [2.0, 7.0, 1.5]])
    lossy, lossless = (
        trace(shoebox((8.0, 9.0, 3.0), "plaster"), receivers[0] + 1, receivers, rays=1000, air=air)
        for air in (True, False)
    )
    assert len(lossy.distance) > 100
    assert np.array_equal(lossy.distance, lossless.distance)
    wanted = np.exp(-air_attenuation() * lossy.distance[:, None].astype(np.float64))
    assert lossy.energy / lossless.energy == pytest.approx(wanted, rel=1e-4)


def decibel(energy: NDArray[np.float64]) -> NDArray[np.float64]:
    return 10 * np.log10(energy)
