"""Third-order spherical-harmonic HRIRs fitted to measured ones.

Below 2 kHz the fit is a least-squares one of the complex spectra, so that time differences are
those of the measurement. Above, a head is too large in wavelengths for the third order, and the fit
is of the magnitudes alone, with the phase that the fit of the next lower frequency has: magnitude
least squares, C. Schoerkhuber, M. Zaunschirm, R. Hoeldrich, "Binaural rendering of ambisonic
signals via magnitude least squares", DAGA 2018.

The diffuse field is then equalised: the minimum-phase filter that makes the mean energy over all
directions and both ears the same in each third of an octave is applied to both ears. It takes out
the loudspeaker and the ear canal of the measurement, and what the third order loses (Z. Ben-Hur et
al., "Spectral equalization in binaural signals represented by order-truncated spherical
harmonics", J. Acoust. Soc. Am. 141, 2017). Differences between the ears do not change.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.spatial import cKDTree

from avn.acoustics.ambisonics import CHANNELS, ORDER, sh
from avn.acoustics.hrtf import ShHrirs
from avn.acoustics.sofa import MeasuredHrirs
from avn.core.errors import UserError

VERSION = 1  # of the method, part of the fingerprints of what is made with it

FEWEST = 2 * CHANNELS  # directions
LARGEST_GAP = 65.0  # degrees from any direction to the nearest measured one
CUT = 2000.0  # Hz, from which magnitudes are fitted
_RIDGE = 0.01  # of the mean eigenvalue, 1; bounds what lies in a gap below the head
_REACH = 20.0  # degrees round a measured direction for which it stands
# Length of the filters, and the mean delay of the ears, as the set of the KU 100 has them.
_SECONDS = 256 / 48000
_LEAD = 0.0008
_LOW = (200.0, 1500.0)  # Hz, where delays are measured
_EQUALISED = (100.0, 16000.0)  # Hz; beyond, the gain is that of the end of the range
_MOST_GAIN = 20.0  # dB, up or down
# The weight of each channel from SN3D to N3D, in which the harmonics are orthonormal.
_N3D = np.sqrt(np.repeat(2 * np.arange(ORDER + 1) + 1, 2 * np.arange(ORDER + 1) + 1))


def fit_sh_hrirs(measured: MeasuredHrirs, name: str = "acoustics.head") -> ShHrirs:
    """Fit third-order filters to measured HRIRs.

    Parameters
    ----------
    measured : MeasuredHrirs
        Responses of 32 or more directions all round the head.
    name : str
        Setting and file, for messages.

    Returns
    -------
    ShHrirs
        Filters of 5.3 ms at the rate of the measurement.

    Raises
    ------
    UserError
        If the directions are too few or do not cover the sphere.
    """
    rate, weights = measured.rate, solid_angles(measured.directions, name)
    size = fft.next_fast_len(max(2 * measured.responses.shape[-1], rate // 20), real=True)
    harmonics = sh(measured.directions) * _N3D
    gram = harmonics.T @ (weights[:, None] * harmonics) + _RIDGE * np.eye(CHANNELS)
    solver = np.asarray(np.linalg.solve(gram, harmonics.T * weights), dtype=np.float64)
    # about the head's centre, where the phase changes least with frequency
    centre = _advance(_delay(measured.responses, weights, size, rate), size)
    spectra = [fft.rfft(measured.responses[:, ear], size) * centre for ear in (0, 1)]
    ears = np.stack([_least_squares(own, harmonics, solver, rate) for own in spectra])
    ears *= _equaliser(ears, size, rate)
    # In N3D the mean over all directions is the sum over channels.
    delay = _delay(fft.irfft(ears, size).swapaxes(0, 1), np.ones(CHANNELS), size, rate)
    responses = fft.irfft(ears * _advance(delay - _LEAD * rate, size), size)
    fitted = responses[..., : round(_SECONDS * rate)] * _N3D[:, None]
    fitted *= _fades(fitted.shape[-1], rate)
    fitted.setflags(write=False)
    return ShHrirs(fitted, rate)


def solid_angles(directions: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """Compute the share of the sphere of each direction, from a dense grid of points.

    Points far from all directions, in a gap, count for none.

    Raises
    ------
    UserError
        If the directions are too few or do not cover the sphere.
    """
    if len(directions) < FEWEST:
        raise UserError(
            f"{name}: {len(directions)} directions are too few; give a file of {FEWEST} or more"
        )
    count = max(10000, 5 * len(directions))
    height = 1 - (2 * np.arange(count) + 1) / count
    turn, flat = np.arange(count) * np.pi * (3 - np.sqrt(5)), np.sqrt(1 - height**2)
    points = np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)
    points = np.concatenate([points, points * [-1, 1, 1]])  # so that symmetric heads stay so
    chord, nearest = cKDTree(directions).query(points)
    apart = np.degrees(2 * np.arcsin(np.minimum(chord / 2, 1)))
    if apart.max() > LARGEST_GAP:
        east, north, up = points[apart.argmax()]
        azimuth, elevation = np.degrees([np.arctan2(-east, north) % (2 * np.pi), np.arcsin(up)])
        raise UserError(
            f"{name}: its directions do not cover the sphere, the nearest to azimuth {azimuth:.0f} "
            f"and elevation {elevation:.0f} is {apart.max():.0f} degrees off; give a file with one "
            f"within {LARGEST_GAP:.0f} degrees of everywhere"
        )
    own = np.bincount(np.asarray(nearest)[apart < _REACH], minlength=len(directions))
    return np.asarray(own / own.sum())


def _least_squares(
    spectra: NDArray[np.complex128],
    harmonics: NDArray[np.float64],
    solver: NDArray[np.float64],
    rate: int,
) -> NDArray[np.complex128]:
    """Fit the channels (16, bins) of one ear to its spectra (M, bins)."""
    bins = spectra.shape[1]
    cut = int(np.ceil(CUT / (rate / 2) * (bins - 1)))
    fitted = np.empty((bins, CHANNELS, 2))  # real and imaginary part
    low = (solver @ spectra[:, :cut].real, solver @ spectra[:, :cut].imag)
    fitted[:cut] = np.stack(low, axis=-1).swapaxes(0, 1)
    magnitudes = np.ascontiguousarray(np.abs(spectra.T))
    for k in range(cut, bins):  # each takes the phase of the one before
        wave = harmonics @ fitted[k - 1]
        size = np.maximum(np.hypot(wave[:, 0], wave[:, 1]), np.finfo(float).tiny)
        fitted[k] = solver @ (wave * (magnitudes[k] / size)[:, None])
    return (fitted[..., 0] + 1j * fitted[..., 1]).T


def _delay(
    responses: NDArray[np.float64], weights: NDArray[np.float64], size: int, rate: int
) -> float:
    """Compute the mean delay of responses (M, 2, taps) at low frequencies, in samples.

    It is the group delay, weighted by energy: the sum of Re(T conj(H)) over that of ``|H|^2``,
    where T is the spectrum of the responses times the index of the sample.
    """
    low = slice(*(round(frequency * size / rate) for frequency in _LOW))
    ramp = np.arange(responses.shape[-1])
    ramp = np.where(ramp > size // 2, ramp - size, ramp)  # times before 0 are at the end
    spectra = fft.rfft(responses, size)[..., low]
    moments = fft.rfft(responses * ramp, size)[..., low]
    moment = (moments * spectra.conj()).real.sum(axis=(1, 2))
    return float(weights @ moment / (weights @ (np.abs(spectra) ** 2).sum(axis=(1, 2))))


def _advance(samples: float, size: int) -> NDArray[np.complex128]:
    """Return the spectrum that advances a response by some samples, in a circle of `size`."""
    return np.exp(2j * np.pi * np.arange(size // 2 + 1) / size * samples)


def _equaliser(ears: NDArray[np.complex128], size: int, rate: int) -> NDArray[np.complex128]:
    """Return the minimum-phase spectrum that makes the diffuse field of both ears flat."""
    frequencies = fft.rfftfreq(size, 1 / rate)
    energy = np.concatenate([[0.0], np.cumsum((np.abs(ears) ** 2).sum(axis=(0, 1)))])
    edges = np.append(frequencies, frequencies[-1] + rate / size) - rate / size / 2
    lowest, highest = _EQUALISED[0], min(_EQUALISED[1], 0.9 * rate / 2)
    held = np.clip(frequencies, lowest, highest)
    below, above = held * 2 ** (-1 / 6), held * 2 ** (1 / 6)
    mean = (np.interp(above, edges, energy) - np.interp(below, edges, energy)) / (above - below)
    level = -10 * np.log10(mean / np.exp(np.log(mean[frequencies <= highest]).mean()))
    gain = np.clip(level, -_MOST_GAIN, _MOST_GAIN) * np.log(10) / 20
    # The phase is the Hilbert transform of the logarithm: fold the cepstrum to positive times.
    cepstrum = fft.irfft(gain, size)
    cepstrum[1 : (size + 1) // 2] *= 2
    cepstrum[size // 2 + 1 :] = 0
    spectrum: NDArray[np.complex128] = np.exp(fft.rfft(cepstrum))
    return spectrum


def _fades(taps: int, rate: int) -> NDArray[np.float64]:
    """Return a window of `taps` samples with half cosines of 0.25 ms and 1 ms at its ends."""
    window = np.ones(taps)
    start, end = round(0.00025 * rate), round(0.001 * rate)
    window[:start] = np.sin(np.pi / 2 * np.arange(start) / start) ** 2
    window[taps - end :] = np.cos(np.pi / 2 * np.arange(1, end + 1) / end) ** 2
    return window
