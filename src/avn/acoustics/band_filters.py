"""Octave-band filters.

The bands overlap so that their amplitudes sum to one at every frequency: an event of equal energy
in all bands, like the echo of a flat surface, is a single sample. The lowest band reaches down to
0 Hz and the highest up to half the sampling rate.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from avn.acoustics.materials import BANDS

HALF_SECONDS = 0.01  # on either side of the middle of a band filter
_GRID_SECONDS = 0.256  # least period of the spectra from which filters are designed
_KAISER = 3.0  # beta of the Kaiser window: a compromise of transition width and ripple


def band_weights(frequencies: NDArray[np.floating]) -> NDArray[np.float64]:
    """Compute each band's amplitude at given frequencies, shape (6, ...); bands sum to 1.

    Between the centres of two neighbouring bands the amplitudes are raised cosines of the
    logarithm of frequency.

    Parameters
    ----------
    frequencies : array
        In Hz.
    """
    low, high = np.log2(BANDS[0]), np.log2(BANDS[-1])
    octave = np.clip(np.log2(np.maximum(frequencies, 1e-3)), low, high) - low
    away = np.abs(octave[None] - np.arange(len(BANDS)).reshape(-1, *[1] * frequencies.ndim))
    weights: NDArray[np.float64] = np.where(away < 1, np.cos(0.5 * np.pi * away) ** 2, 0.0)
    return weights


def half_length(rate: int) -> int:
    """Return the samples on either side of the middle of a band filter, at a rate in Hz."""
    return round(HALF_SECONDS * rate)


def _grid(rate: int) -> int:
    """Return the length of the transform from which filters are designed, a power of 2."""
    return 1 << (round(_GRID_SECONDS * rate) - 1).bit_length()


@lru_cache(maxsize=4)
def band_firs(rate: int) -> NDArray[np.float32]:
    """Design the bands' symmetric filters; they sum to a unit impulse.

    Parameters
    ----------
    rate : int
        Sampling rate in Hz.

    Returns
    -------
    float32 array, shape (6, 2 `half_length(rate)` + 1)
    """
    spectrum = band_weights(np.fft.rfftfreq(_grid(rate), 1 / rate))
    response = np.fft.fftshift(np.fft.irfft(spectrum, axis=1), axes=1)
    middle, half = _grid(rate) // 2, half_length(rate)
    firs = response[:, middle - half : middle + half + 1] * np.kaiser(2 * half + 1, _KAISER)
    result = firs.astype(np.float32)
    result.setflags(write=False)
    return result


def minimum_phase(gains: NDArray[np.float64], rate: int, taps: int) -> NDArray[np.float64]:
    """Design minimum-phase filters with the given amplitude in each band.

    Parameters
    ----------
    gains : array, shape (N, 6)
        Amplitudes, above 0.
    rate, taps : int
        Sampling rate in Hz, and length of the filters.

    Returns
    -------
    array, shape (N, taps)
        Causal; made by folding the cepstrum (Oppenheim and Schafer, *Discrete-Time Signal
        Processing*, section 13.8).
    """
    grid = _grid(rate)
    weights = band_weights(np.fft.rfftfreq(grid, 1 / rate))
    cepstrum = np.fft.irfft(np.log(np.maximum(gains, 1e-6) @ weights), axis=1)
    folded = np.zeros_like(cepstrum)
    folded[:, 0] = cepstrum[:, 0]
    folded[:, 1 : grid // 2] = 2 * cepstrum[:, 1 : grid // 2]
    folded[:, grid // 2] = cepstrum[:, grid // 2]
    response = np.fft.irfft(np.exp(np.fft.rfft(folded, axis=1)), axis=1)[:, :taps]
    fade = np.ones(taps)
    fade[taps // 2 :] = np.cos(0.5 * np.pi * np.linspace(0, 1, taps - taps // 2)) ** 2
    result: NDArray[np.float64] = response * fade
    return result
