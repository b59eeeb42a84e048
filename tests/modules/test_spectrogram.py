import math

import pytest
import torch

from avn.core.errors import UserError
from avn.modules.spectrogram import Spectrogram, band_weights


@pytest.fixture
def clips() -> torch.Tensor:
    return torch.randn(3, 2, 16000, generator=torch.Generator().manual_seed(0)) * 0.1


def test_exchanged_ears_exchange_the_powers_and_turn_the_phase_round(clips: torch.Tensor) -> None:
    for bands, frames in ((64, 64), (128, 125)):
        spectrogram = Spectrogram(bands=bands, frames=frames)
        left, right, real, imaginary = spectrogram(clips).unbind(1)
        assert left.shape == (3, bands, frames)
        exchanged = torch.stack((right, left, real, -imaginary), dim=1)
        torch.testing.assert_close(spectrogram(clips.flip(1)), exchanged, atol=1e-4, rtol=1e-4)
        powers = Spectrogram(bands=bands, frames=frames, interaural=False)(clips)
        torch.testing.assert_close(powers, torch.stack((left, right), dim=1))


def test_coherence_of_equal_ears_is_one_and_of_a_delay_turns_with_frequency() -> None:
    noise = torch.randn(1, 16000, generator=torch.Generator().manual_seed(1)) * 0.1
    delay = 4  # samples
    clip = torch.stack((noise, noise.roll(delay, dims=-1)), dim=1)
    linear = Spectrogram(scale="linear", bands=64)
    same = linear(torch.stack((noise, noise), dim=1))
    torch.testing.assert_close(same[:, 2], torch.ones_like(same[:, 2]), atol=1e-3, rtol=0)
    torch.testing.assert_close(same[:, 3], torch.zeros_like(same[:, 3]), atol=1e-3, rtol=0)
    real, imaginary = linear(clip)[0, 2:].mean(dim=-1)
    found = torch.atan2(imaginary, real)[4:24].abs()
    hertz = (torch.arange(64) + 0.5)[4:24] * 8000 / 64
    expected = 2 * math.pi * hertz * delay / 16000
    wrapped = expected.where(expected < math.pi, 2 * math.pi - expected)
    torch.testing.assert_close(found, wrapped, atol=0.2, rtol=0)


@pytest.mark.parametrize("scale", ["mel", "linear"])
def test_absolute_level_is_kept(clips: torch.Tensor, scale: str) -> None:
    spectrogram = Spectrogram(scale=scale)
    quiet, loud = spectrogram(clips), spectrogram(clips * 10)
    torch.testing.assert_close(loud[:, :2], quiet[:, :2] + 2, atol=1e-4, rtol=0)
    torch.testing.assert_close(loud[:, 2:], quiet[:, 2:], atol=1e-4, rtol=0)


def test_power_of_a_tone_is_its_mean_square() -> None:
    tone = 0.2 * torch.sin(2 * math.pi * 1000 * torch.arange(16000) / 16000)
    picture = Spectrogram(scale="linear", stft_window=0.032, bands=256)(tone.expand(1, 2, -1))
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
    ("key", "value"),
    [("scale", "bark"), ("stft_window", 0.0000625), ("frames", 60), ("bands", 300)],
)
def test_bad_option_is_named(key: str, value: object) -> None:
    with pytest.raises(UserError, match=f"spectrogram.{key} is '?{value}"):
        Spectrogram(**{key: value})
