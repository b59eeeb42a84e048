"""Binaural spectrograms without the absolute level of a clip, for sounds of unknown loudness."""

from __future__ import annotations

import torch
from torch import Tensor

from avn.modules.spectrogram import POWER_FLOOR, Spectrogram


class LevelFreeSpectrogram(Spectrogram):
    """Spectrograms of clips that are scaled to one power.

    A clip that is louder as a whole has the same spectrogram, so a network on it estimates distance
    from reverberation and spectrum and not from loudness. Differences between the ears are kept.

    Parameters
    ----------
    **settings
        Those of `Spectrogram`.
    """

    def _pictures(self, clips: Tensor) -> Tensor:
        power = clips.square().mean((1, 2), keepdim=True).clamp_min(POWER_FLOOR)
        return super()._pictures(clips * torch.rsqrt(power) * _LEVEL)


# RMS of the scaled clips, near that of a source three metres away.
_LEVEL = 0.1
