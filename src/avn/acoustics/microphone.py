"""Microphones, which turn the sound at the ears into the samples of a clip."""

from __future__ import annotations

from math import isfinite
from typing import Protocol

from torch import Tensor

from avn.core.errors import UserError


class ClipNoise(Protocol):
    """Random numbers of N clips: a pure function of the identity of each clip."""

    def __call__(self, ear: int) -> Tensor:
        """Return noise of RMS 1 for ear 0 or 1, (N, T) float32; the ears are independent."""

    def integers(self, draw: int) -> Tensor:
        """Return draw 0, 1, 2, ... of each clip, (N,) int64, uniform over 0 to 2^63 - 1."""

    def uniform(self, draw: int) -> Tensor:
        """Return that draw as a number of 0 to 1, (N,) float32."""


class Microphone:
    """Two microphones, one at each ear: a gain, then additive noise.

    Derive from this class for other conditions.

    Parameters
    ----------
    noise_rms : float
        RMS of each microphone's noise. Dry sounds have RMS 1, so the direct sound of a source at
        1 m in front has 1 / sqrt(4 pi) = 0.28, which is 35 dB above the default; three rooms
        away, some 24 dB weaker, sound is still 11 dB above it.
    gain : float
        Factor on the sound at the microphone, before its noise.

    Raises
    ------
    UserError
        If a value is out of range.
    """

    def __init__(self, noise_rms: float = 0.005, gain: float = 1.0) -> None:
        if not (isfinite(noise_rms) and noise_rms >= 0):
            raise UserError(f"microphone.noise_rms={noise_rms}: give 0 or more, such as 0.005")
        if not (isfinite(gain) and gain > 0):
            raise UserError(f"microphone.gain={gain}: give more than 0, such as 1.0")
        self.noise_rms, self.gain = noise_rms, gain

    def record(self, clips: Tensor, noise: ClipNoise) -> Tensor:
        """Record clips; may change them in place.

        Parameters
        ----------
        clips : (N, 2, T) float32 tensor
            Sound at the left and the right ear.
        noise : ClipNoise
            Its call returns noise of RMS 1 for ear 0 or 1, (N, T), the same at every call.

        Returns
        -------
        (N, 2, T) float32 tensor
        """
        if self.gain != 1:
            clips *= self.gain
        if self.noise_rms > 0:
            for ear in range(2):
                clips[:, ear].add_(noise(ear), alpha=self.noise_rms)
        return clips
