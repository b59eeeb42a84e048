"""Power spectrograms of two ears, the input of the paper's and of the released sound network."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from avn.modules.spectrogram import POWER_FLOOR, Spectrogram


class PowerSpectrogram(Spectrogram):
    """Power of the short-time Fourier transform of both ears, pooled into frequency bands.

    The squared magnitude of the transform with a Hann window, which is not scaled by the window's
    length, without normalisation or interaural channels.

    Parameters
    ----------
    rate : int
        Sampling rate in hertz; a clip is one second long.
    stft_window : float
        Length of the Hann window in seconds.
    bands : int
        Number of frequency bands.
    frames : int
        Number of time frames, a divisor of `rate`.
    scale : {"mel", "linear"}
        Frequency scale on which the bands are spaced evenly.
    log : bool
        Whether the decimal logarithm of the power is taken.

    Raises
    ------
    UserError
        Where a parameter is out of range.
    """

    def __init__(
        self,
        rate: int = 16000,
        stft_window: float = 0.032,
        bands: int = 64,
        frames: int = 64,
        scale: str = "linear",
        log: bool = False,
    ) -> None:
        super().__init__(rate, stft_window, bands, frames, scale, interaural=False)
        self.log = log
        # `_stft` scales the sum over bins to the mean square of the signal
        self._unscaled = self.window * float(self.hann.square().sum()) / 2.0

    def forward(self, clips: Tensor) -> Tensor:
        """Compute the spectrograms of N clips.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor
            Left and right ear. A clip is periodic: its end joins its start.

        Returns
        -------
        (N, 2, bands, frames) float32 tensor
            Left and right power; 20 dB more are a factor of 100, or with `log` 2 more.
        """
        return super().forward(clips)

    def _pictures(self, clips: Tensor) -> Tensor:
        spectra = self._stft(clips)
        power = spectra.real.square() + spectra.imag.square()
        pooled = (power @ self.band_weights).transpose(-1, -2)
        if self.log:
            pooled = torch.log10(pooled.clamp_min(POWER_FLOOR))
            return pooled + math.log10(self._unscaled)
        return pooled * self._unscaled
