"""Noise of a diffuse field at two ears, made from mono recordings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.acoustics.materials import SPEED_OF_SOUND

# Distance of the ears, metres.
EARS = 0.17


def diffuse_noise(
    samples: NDArray[np.float32], rate: int, distance: float = EARS
) -> NDArray[np.float32]:
    """Make noise of a spherically isotropic field at two points from a recording.

    The spectrum of each point is that of the recording. The coherence of the two is that of the
    field, sin(k d) / (k d) with the wave number k and the distance d (Habets and Gannot,
    "Generating sensor signals in isotropic noise fields", JASA 122, 2007): low tones are the same
    at both points, high tones are independent. Two stretches of the recording, half its length
    apart, serve as the independent signals.

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
    first, second = np.fft.rfft(np.stack((wave, np.roll(wave, len(wave) // 2))))
    # sin(k d) / (k d), with k = 2 pi f / c; numpy's sinc(x) is sin(pi x) / (pi x)
    coherence = np.sinc(2 * distance / SPEED_OF_SOUND * np.fft.rfftfreq(len(wave), 1 / rate))
    # symmetric in the two ears: each is shared and own part in equal shares
    same, own = np.sqrt((1 + coherence) / 2), np.sqrt((1 - coherence) / 2)
    both = np.fft.irfft(
        np.stack((same * first + own * second, same * first - own * second)), len(wave)
    )
    level = np.sqrt(np.mean(both**2, axis=1, keepdims=True))
    return (both / level).astype(np.float32)
