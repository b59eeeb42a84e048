"""Spectrograms without level: what they keep and what they lose."""

import torch

from avn.modules.level_free_spectrogram import LevelFreeSpectrogram
from avn.modules.spectrogram import Spectrogram


def test_a_louder_clip_has_the_same_spectrogram_and_ears_keep_their_difference():
    torch.manual_seed(0)
    clips = torch.randn(3, 2, 16000) * torch.tensor([0.3, 0.1])[None, :, None]
    free = LevelFreeSpectrogram()
    torch.testing.assert_close(free(4.0 * clips), free(clips), atol=1e-5, rtol=1e-5)
    assert not torch.allclose(Spectrogram()(4.0 * clips), Spectrogram()(clips), atol=0.1)
    # 9.5 dB between the ears
    levels = free(clips)[:, :2].mean((2, 3))
    torch.testing.assert_close(
        levels[:, 0] - levels[:, 1], torch.full((3,), 0.954), atol=0.02, rtol=0
    )


def test_silence_stays_silent():
    assert torch.isfinite(LevelFreeSpectrogram()(torch.zeros(1, 2, 16000))).all()
