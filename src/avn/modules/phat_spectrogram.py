"""Spectrograms with the cross-correlation of the ears, from which the spectrum is removed."""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import Tensor

from avn.core.errors import UserError
from avn.modules.spectrogram import Spectrogram

# Magnitude below which a bin counts less, as a share of the mean magnitude of its frame.
_FLOOR = 0.05


class PhatSpectrogram(Spectrogram):
    """Spectrograms of both ears, with one more channel: generalised cross-correlation by frame.

    The phase transform divides each bin of the cross-spectrum by its magnitude (Knapp and Carter,
    "The generalized correlation method for estimation of time delay", IEEE Transactions on
    Acoustics, Speech, and Signal Processing 24, 1976). The delay between the ears is a peak,
    whatever the spectrum of the sound. The channel has as many lags as there are bands.

    Parameters
    ----------
    longest_lag : float
        Longest lag in seconds, more than 0 and up to half of the window; a head's is 0.0007.
    **spectrogram
        Those of `Spectrogram`.

    Raises
    ------
    UserError
        Where a parameter is out of range.
    """

    cosines: Tensor
    sines: Tensor

    def __init__(self, longest_lag: float = 0.001, **spectrogram: Any) -> None:
        super().__init__(**spectrogram)
        half = self.window / self.rate / 2
        if not 0 < longest_lag <= half:
            raise UserError(
                f"spectrogram.longest_lag is {longest_lag}; give more than 0 and up to {half:g} s"
            )
        lags = torch.linspace(-longest_lag, longest_lag, self.bands, dtype=torch.float64)
        bins = torch.arange(self.window // 2 + 1, dtype=torch.float64) * (self.rate / self.window)
        angles = 2 * math.pi * bins[:, None] * lags
        self.register_buffer("cosines", (angles.cos() / len(bins)).float(), persistent=False)
        self.register_buffer("sines", (angles.sin() / len(bins)).float(), persistent=False)

    @property
    def channels(self) -> int:
        """Number of channels: one more than that of `Spectrogram`."""
        return super().channels + 1

    def _pictures(self, clips: Tensor) -> Tensor:
        pooled = super()._pictures(clips)
        spectra = self._stft(clips)
        cross = spectra[:, 0] * spectra[:, 1].conj()
        size = cross.abs()
        cross = cross / (size + _FLOOR * size.mean(-1, keepdim=True) + 1e-20)
        lagged = cross.real @ self.cosines - cross.imag @ self.sines
        return torch.cat((pooled, lagged.transpose(1, 2)[:, None]), 1)

    def mirror(self, pictures: Tensor) -> Tensor:
        """Return the spectrograms with the ears exchanged. See `Spectrogram.mirror`."""
        others = super().mirror(pictures[:, :-1])
        return torch.cat((others, pictures[:, -1:].flip(2)), 1)
