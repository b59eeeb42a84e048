import math

import pytest
import torch

from avn.core.errors import UserError
from avn.modules.spectrogram import Spectrogram, band_weights


@pytest.fixture
def clips() -> torch.Tensor:
    return torch.randn(3, 2, 16000, generator=torch.Generator().manual_seed(0)) * 0.1


def test_shapes(clips: torch.Tensor) -> None:
    assert Spectrogram()(clips).shape == (3, 4, 64, 64)
    assert Spectrogram(interaural=False)(clips).shape == (3, 2, 64, 64)
    assert Spectrogram(bands=128, frames=128, scale="linear")(clips).shape == (3, 4, 128, 128)


@pytest.mark.parametrize("scale", ["mel", "linear"])
def test_absolute_level_is_kept(clips: torch.Tensor, scale: str) -> None:
    spectrogram = Spectrogram(scale=scale)
    quiet, loud = spectrogram(clips), spectrogram(clips * 10)
    torch.testing.assert_close(loud[:, :2], quiet[:, :2] + 2, atol=1e-4, rtol=0)
    torch.testing.assert_close(loud[:, 2:], quiet[:, 2:], atol=1e-4, rtol=0)


def test_power_of_a_tone_is_its_mean_square() -> None:
    tone = 0.2 * torch.sin(2 * math.pi * 1000 * torch.arange(16000) / 16000)
    picture = Spectrogram(scale="linear", window=512, bands=256)(tone.expand(1, 2, -1))
    power = 10 ** (picture[0, 0, :, 0] - 4)
    assert power.argmax() in (31, 32)  # 1000 Hz of bands 31.1 Hz apart
    assert power.sum().item() == pytest.approx(0.2**2 / 2, rel=0.03)


def test_clip_is_circular(clips: torch.Tensor) -> None:
    spectrogram = Spectrogram()
    rolled = spectrogram(clips.roll(250 * 5, dims=-1))
    torch.testing.assert_close(rolled, spectrogram(clips).roll(5, dims=-1), atol=2e-4, rtol=1e-4)


def test_coherence_shows_which_ear_is_first() -> None:
    noise = torch.randn(1, 16000, generator=torch.Generator().manual_seed(1))
    delay = 4
    picture = Spectrogram(scale="mel")(torch.stack((noise, noise.roll(delay, -1)), 1))[0]
    band = int(band_weights(16000, 512, 64, "mel")[16].argmax())  # bin 16 is 500 Hz
    phase = torch.atan2(picture[3, band].mean(), picture[2, band].mean())
    assert phase.item() == pytest.approx(2 * math.pi * 500 * delay / 16000, abs=0.12)
    same = Spectrogram()(torch.stack((noise, noise), 1))[0]
    torch.testing.assert_close(same[2], torch.ones_like(same[2]), atol=1e-3, rtol=0)


@pytest.mark.parametrize("interaural", [True, False])
def test_mirror_is_the_picture_of_exchanged_ears(clips: torch.Tensor, interaural: bool) -> None:
    spectrogram = Spectrogram(interaural=interaural)
    exchanged = spectrogram(clips.flip(1))
    torch.testing.assert_close(spectrogram.mirror(spectrogram(clips)), exchanged)


@pytest.mark.parametrize("scale", ["mel", "linear"])
def test_every_band_hears_something(scale: str) -> None:
    weights = band_weights(16000, 512, 128, scale)
    assert weights.shape == (257, 128)
    assert (weights.sum(0) > 0).all()
    # From the first band's centre to the last one's, no frequency is lost.
    heard = weights.sum(1)
    assert (heard[2:-4] > 0).all()


@pytest.mark.parametrize(
    ("key", "value"), [("scale", "bark"), ("window", 1), ("frames", 60), ("bands", 300)]
)
def test_bad_option_is_named(key: str, value: object) -> None:
    with pytest.raises(UserError, match=f"spectrogram.{key} is '?{value}"):
        Spectrogram(**{key: value})
