"""Clips: steady state, level, noise and draws that depend on integers alone."""

from pathlib import Path

import numpy as np
import pytest
import soundfile
import torch

from avn.acoustics.clips import (
    PURPOSES,
    ClipRenderer,
    DrySounds,
    brir_spectra,
    export_wav,
)
from avn.acoustics.dry_sounds import BUILTIN, RATE, load_sounds
from avn.acoustics.microphone import Microphone
from avn.core.clip_id import ClipId
from avn.core.errors import UserError

QUIET = Microphone(noise_rms=0.0)


@pytest.fixture(scope="module")
def bank() -> DrySounds:
    return DrySounds(load_sounds({name: name for name in BUILTIN}))


def looped_tone(frequency: float, samples: int) -> np.ndarray:
    """A sine of unit RMS."""
    wave = np.sin(2 * np.pi * frequency * np.arange(samples) / RATE) * 2**0.5
    return wave.astype(np.float32)


def delays(samples: list[int], taps: int = 9600) -> torch.Tensor:
    """BRIRs (N, 2, taps) that only delay."""
    brirs = torch.zeros(len(samples), 2, taps)
    brirs[torch.arange(len(samples)), :, torch.tensor(samples)] = 1
    return brirs


def same(renderer: ClipRenderer, brirs: torch.Tensor, **changed: int) -> torch.Tensor:
    """One and the same clip for every BRIR."""
    words = {"source": 1, "state": 2, "sound": 0, "realisation": 3} | changed
    keys = {name: torch.full((len(brirs),), value) for name, value in words.items()}
    return renderer.render(brir_spectra(brirs), ClipId(**keys))


def many(
    renderer: ClipRenderer, count: int, brir: torch.Tensor | None = None, sound: int = 0
) -> torch.Tensor:
    """Clips of ``count`` takes through one BRIR (a unit impulse unless told)."""
    zeros = torch.zeros(count, dtype=torch.int64)
    spectra = brir_spectra(delays([0]) if brir is None else brir)
    realisations = torch.arange(count)
    return renderer.render(spectra, ClipId(zeros, zeros, zeros + sound, realisations), index=zeros)


@pytest.mark.parametrize("frequency", [440.0, 440.37])
def test_a_steady_tone_does_not_betray_the_time_of_flight(frequency: float) -> None:
    sounds = DrySounds({"tone": looped_tone(frequency, 23456)})
    clips = same(ClipRenderer(sounds, QUIET, 0, "eval"), delays([0, 1, 77, 1600, 9599]))
    spectra = torch.fft.rfft(clips).abs()
    torch.testing.assert_close(spectra, spectra[:1].expand_as(spectra), atol=2e-2, rtol=1e-4)
    # No onset: every tenth of a second is as loud in all of them.
    blocks = clips.unflatten(-1, (10, -1)).square().mean(-1)
    assert blocks.min() > 0.8 * blocks.max()


def test_a_tone_of_whole_cycles_has_no_seam() -> None:
    sounds = DrySounds({"tone": looped_tone(440.0, 2 * RATE)})
    clips = many(ClipRenderer(sounds, QUIET, 0, "eval"), 20)
    spectra = torch.fft.rfft(clips).abs() ** 2
    assert (spectra[..., 440] / spectra.sum(-1)).min() > 0.99999


def test_the_seam_of_a_second_is_smooth_and_lies_anywhere() -> None:
    sounds = DrySounds({"tone": looped_tone(100.5, 2 * RATE)})  # half a cycle is left over
    clips = many(ClipRenderer(sounds, QUIET, 0, "eval"), 200)[:, 0]
    steepest = 2**0.5 * 2 * np.pi * 100.5 / RATE
    rolled = torch.cat([clips, clips[:, :1]], dim=1)
    assert rolled.diff(dim=1).abs().max() < 1.5 * steepest
    quietest = clips.square().unflatten(-1, (100, -1)).mean(-1).argmin(dim=1)
    assert len((quietest // 10).unique()) == 10


def test_every_sound_is_as_loud_on_average(bank: DrySounds) -> None:
    renderer = ClipRenderer(bank, QUIET, 0, "eval")
    for sound in range(len(bank)):
        clips = many(renderer, 400, sound=sound)
        level = 10 * torch.log10(clips.square().mean((1, 2)))
        assert clips.square().mean() == pytest.approx(1, abs=0.1)
        assert level.min() > -7  # no take is silent


def test_a_sparse_recording_is_heard_in_every_take() -> None:
    sparse = np.zeros(20 * RATE, dtype=np.float32)
    sparse[50_000:56_000] = np.random.default_rng(0).standard_normal(6000)
    sparse /= np.sqrt(np.mean(sparse**2))
    clips = many(ClipRenderer(DrySounds({"bark": sparse}), QUIET, 0, "eval"), 100)
    power = clips.square().mean((1, 2))
    assert power.min() > 0.2
    assert power.mean() == pytest.approx(1, abs=0.1)


def test_convolution_is_circular_and_longer_responses_fold() -> None:
    generator = np.random.default_rng(1)
    sounds = DrySounds({"noise": generator.standard_normal(RATE).astype(np.float32)})
    renderer = ClipRenderer(sounds, QUIET, 0, "eval")
    brir = torch.from_numpy(generator.standard_normal((1, 2, 20_000)).astype(np.float32)) * 0.01
    dry = same(renderer, delays([0]))[0, 0].double().numpy()
    wet = same(renderer, brir)[0, 1].double().numpy()
    endless = np.convolve(np.tile(dry, 4), brir[0, 1].double().numpy())
    np.testing.assert_allclose(wet, endless[3 * RATE : 4 * RATE], atol=1e-4)


def test_the_noise_floor_has_its_level_and_differs_between_ears_and_takes() -> None:
    sounds = DrySounds({"tone": looped_tone(440.0, RATE)})
    renderer = ClipRenderer(sounds, Microphone(noise_rms=0.02), 0, "eval")
    noise = many(renderer, 30, brir=torch.zeros(1, 2, 100)).flatten(0, 1)
    assert noise.square().mean().sqrt() == pytest.approx(0.02, rel=0.01)
    correlation = torch.corrcoef(noise) - torch.eye(len(noise))
    assert correlation.abs().max() < 0.05


def test_the_noise_of_training_and_of_evaluation_is_independent() -> None:
    sounds = DrySounds({"tone": looped_tone(440.0, RATE)})
    seed = 0  # of training and of evaluation alike
    banks = [ClipRenderer(sounds, Microphone(), seed, purpose)._noise for purpose in PURPOSES]
    spectra = [torch.fft.rfft(bank, n=2 * bank.shape[1]) for bank in banks]
    train, evaluation = (each / each.abs().square().mean().sqrt() for each in spectra)
    for ears in (train * evaluation.conj(), train * evaluation.flip(0).conj()):
        correlation = torch.fft.irfft(ears).abs().max()  # at every shift
        assert correlation < 0.02
    assert torch.fft.irfft(train * train.conj()).abs().max() > 0.9


def test_gain_scales_the_sound_and_leaves_the_noise(bank: DrySounds) -> None:
    plain, loud, twice = (
        same(ClipRenderer(bank, Microphone(noise, gain), 0, "eval"), delays([5]))
        for noise, gain in ((0.0, 1.0), (0.005, 1.0), (0.005, 2.0))
    )
    torch.testing.assert_close(twice - loud, plain, atol=1e-5, rtol=1e-4)


def test_signal_to_noise_at_one_metre_is_between_30_and_40_db() -> None:
    direct = 1 / np.sqrt(4 * np.pi)
    assert 30 < 20 * np.log10(direct / Microphone().noise_rms) < 40


def test_clips_are_the_same_bytes_again_and_in_any_batch(bank: DrySounds) -> None:
    keys = ClipId(*map(torch.tensor, ([0, 1, 2], [5, 5, 6], [0, 1, 2], [0, 3, 1])))
    brirs = torch.randn(3, 2, 800, generator=torch.Generator().manual_seed(0))
    renderer = ClipRenderer(bank, Microphone(), 4, "train")
    clips = renderer.render(brir_spectra(brirs), keys)
    again = ClipRenderer(bank, Microphone(), 4, "train").render(brir_spectra(brirs), keys)
    assert torch.equal(clips, again)
    for row in range(3):
        alone = renderer.render(brir_spectra(brirs[[row]]), ClipId(*(key[[row]] for key in keys)))
        torch.testing.assert_close(alone[0], clips[row], atol=1e-3, rtol=1e-4)
    shared = renderer.render(brir_spectra(brirs), keys, index=torch.tensor([0, 1, 2]))
    assert torch.equal(shared, clips)


@pytest.mark.parametrize("changed", ["source", "state", "realisation", "seed", "purpose"])
def test_each_word_of_the_key_changes_the_clip(bank: DrySounds, changed: str) -> None:
    brir = delays([0])
    base = same(ClipRenderer(bank, QUIET, 0, "eval"), brir)
    if changed == "seed":
        other = same(ClipRenderer(bank, QUIET, 1, "eval"), brir)
    elif changed == "purpose":
        other = same(ClipRenderer(bank, QUIET, 0, "train"), brir)
    else:
        other = same(ClipRenderer(bank, QUIET, 0, "eval"), brir, **{changed: 9})
    assert (base - other).abs().max() > 0.1


def test_a_sound_is_drawn_alike_whichever_sounds_are_beside_it(bank: DrySounds) -> None:
    alone = DrySounds(load_sounds({"clock": "clock"}))
    brir = delays([0])
    ours = same(ClipRenderer(alone, Microphone(), 0, "eval"), brir, sound=0)
    theirs = same(ClipRenderer(bank, Microphone(), 0, "eval"), brir, sound=2)
    torch.testing.assert_close(ours, theirs)


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"noise_rms": -1.0}, "microphone.noise_rms"),
        ({"noise_rms": float("nan")}, "microphone.noise_rms"),
        ({"gain": 0.0}, "microphone.gain"),
    ],
)
def test_a_microphone_that_makes_no_sense(settings: dict[str, float], key: str) -> None:
    with pytest.raises(UserError, match=key):
        Microphone(**settings)


def test_export_writes_a_whole_file_of_two_channels(tmp_path: Path, bank: DrySounds) -> None:
    clip = same(ClipRenderer(bank, QUIET, 0, "eval"), 0.5 * delays([0, 4]))[1]
    target = tmp_path / "new folder" / "clip.wav"
    export_wav(target, clip)
    samples, rate = soundfile.read(target)
    assert rate == RATE
    np.testing.assert_allclose(samples.T, 0.1 * clip.numpy(), atol=1e-4)
    assert [path.name for path in target.parent.iterdir()] == ["clip.wav"]


def test_export_to_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.wav").mkdir()
    for target in (tmp_path / "file" / "clip.wav", tmp_path / "folder.wav"):
        with pytest.raises(UserError, match="cannot be written") as caught:
            export_wav(target, torch.zeros(2, 100))
        assert "\n" not in str(caught.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder.wav"]
