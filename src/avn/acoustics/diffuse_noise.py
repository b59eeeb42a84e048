"""Noise of a diffuse field at two ears, made from mono recordings."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from avn.acoustics.materials import SPEED_OF_SOUND

# Distance of the ears, metres.
EARS = 0.17

# Lower edge of the lowest octave in which two stretches of a recording are compared, Hz.
_LOWEST = 62.5

# Standard deviation of the smoothing of power spectra, Hz.
_SMOOTHING = 10.0


def diffuse_noise(
    samples: NDArray[np.float32], rate: int, distance: float = EARS
) -> NDArray[np.float32]:
    """Make noise of a spherically isotropic field at two points from a recording.

    The spectrum of each point, smoothed with a standard deviation of 10 Hz, is that of the
    recording. The coherence of the two is that of the field, sin(k d) / (k d) with the wave
    number k and the distance d (Habets and Gannot, "Generating sensor signals in isotropic noise
    fields", JASA 122, 2007): low tones are the same at both points, high tones are independent.
    Two stretches of the recording serve as the independent signals, see `independent_shift`. A
    steady tone is the same in all stretches: it has equal levels at the two points, but is
    coherent, with a phase difference that is the same in the whole recording.

    Parameters
    ----------
    samples : (n,) float array
        The recording, which is looped.
    rate : int
        Sampling rate in Hz.
    distance : float
        d in metres.

    Returns
    -------
    (2, n) float32 array
        Looped noise of RMS 1 at the left and the right ear.
    """
    wave = np.asarray(samples, dtype=np.float64)
    other = np.roll(wave, independent_shift(wave, rate))
    first, second = np.fft.rfft(np.stack((wave, other)))
    # sin(k d) / (k d), with k = 2 pi f / c; numpy's sinc(x) is sin(pi x) / (pi x)
    coherence = np.sinc(2 * distance / SPEED_OF_SOUND * np.fft.rfftfreq(len(wave), 1 / rate))
    # each ear gets the shared and its own part in equal shares
    same, own = np.sqrt((1 + coherence) / 2), np.sqrt((1 - coherence) / 2)
    spectra = np.stack((same * first + own * second, same * first - own * second))
    # a steady tone is louder in the sum than in the difference, or softer
    width = _SMOOTHING * len(wave) / rate
    wanted, found = (gaussian_filter1d(np.abs(x) ** 2, width) for x in (first, spectra))
    # a tone of which nothing is left stays away, as it would be rounding noise
    spectra *= np.sqrt(wanted / np.maximum(found, 1e-12 * wanted + np.finfo(float).tiny))
    both = np.fft.irfft(spectra, len(wave))
    level = np.sqrt(np.mean(both**2, axis=1, keepdims=True))
    return (both / np.maximum(level, np.finfo(float).tiny)).astype(np.float32)


def independent_shift(wave: NDArray[np.float64], rate: int) -> int:
    """Return the shift at which a looped recording is least like itself.

    In each octave the likeness is the square of the magnitude of the complex normalised
    autocorrelation, plus the square of its real part: the magnitude is the coherence of the two
    stretches, and the real part makes their sum and their difference unequal in level. The
    octaves count alike.

    Parameters
    ----------
    wave : (n,) float array
        The recording.
    rate : int
        Sampling rate in Hz.

    Returns
    -------
    int
        A shift of n / 4 to n / 2 samples.
    """
    count = len(wave)
    power = np.abs(np.fft.rfft(wave)) ** 2
    frequency = np.fft.rfftfreq(count, 1 / rate)
    likeness = np.zeros(count)
    for octave in range(math.ceil(math.log2(rate / 2 / _LOWEST))):
        low = _LOWEST * 2**octave
        band = np.where((frequency >= low) & (frequency < 2 * low), power, 0.0)
        if total := band.sum():
            # positive frequencies alone: the magnitude is the envelope of the autocorrelation
            correlation = np.fft.ifft(band, count) * (count / total)
            likeness += np.abs(correlation) ** 2 + correlation.real**2
    quarter = count // 4
    return quarter + int(np.argmin(likeness[quarter : count // 2 + 1]))
