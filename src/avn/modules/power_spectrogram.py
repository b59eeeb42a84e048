"""Power spectrograms of two ears without logarithm, the input of the released sound network."""

from __future__ import annotations

from torch import Tensor

from avn.modules.spectrogram import Spectrogram


class PowerSpectrogram(Spectrogram):
    """Power of the short-time Fourier transform of both ears, pooled into frequency bands.

    The squared magnitude of the transform with a Hann window, which is not scaled by the window's
    length; without logarithm, normalisation or interaural channels.

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
    ) -> None:
        super().__init__(rate, stft_window, bands, frames, scale, interaural=False)
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
            Left and right power; 20 dB more are a factor of 100.
        """
        return super().forward(clips)

    def _pictures(self, clips: Tensor) -> Tensor:
        spectra = self._stft(clips)
        power = spectra.real.square() + spectra.imag.square()
        return (power @ self.band_weights).transpose(-1, -2) * self._unscaled
