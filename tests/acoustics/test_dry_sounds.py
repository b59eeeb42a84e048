"""Dry sounds: any audio file becomes 16 kHz mono of unit RMS, and a bad one gives one line."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import soundfile

from avn.acoustics.dry_sounds import BUILTIN, RATE, content_hash, load_sounds, read_sound
from avn.core.errors import UserError


def tone(frequency: float, seconds: float, rate: int) -> np.ndarray:
    """A sine of amplitude 0.5."""
    return 0.5 * np.sin(2 * np.pi * frequency * np.arange(round(seconds * rate)) / rate)


def rms(samples: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(samples.astype(np.float64) ** 2)))


def loudest_frequency(samples: np.ndarray) -> float:
    """Frequency in Hz of the largest peak of the spectrum."""
    spectrum = np.abs(np.fft.rfft(samples))
    return float(np.fft.rfftfreq(len(samples), 1 / RATE)[spectrum.argmax()])


@pytest.mark.parametrize("name", BUILTIN)
def test_builtin_sounds_have_unit_rms_and_sound_below_8_khz(name: str) -> None:
    samples = read_sound(name)
    assert samples.dtype == np.float32
    assert len(samples) >= RATE
    assert rms(samples) == pytest.approx(1, abs=1e-4)
    assert np.isfinite(samples).all()
    assert 100 < loudest_frequency(samples) < 6000


@pytest.mark.parametrize("rate", [8000, 11025, 16000, 22050, 44100, 48000, 96000])
@pytest.mark.parametrize("channels", [1, 2, 6])
def test_any_rate_and_number_of_channels(tmp_path: Path, rate: int, channels: int) -> None:
    path = tmp_path / "tone.wav"
    soundfile.write(path, np.tile(tone(1000, 1.5, rate)[:, None], channels), rate)
    samples = read_sound(path)
    assert samples.shape == (pytest.approx(1.5 * RATE, abs=1),)
    assert loudest_frequency(samples) == pytest.approx(1000, abs=1)
    assert rms(samples) == pytest.approx(1, abs=1e-4)


@pytest.mark.parametrize("suffix", ["flac", "ogg", "aiff", "wav", "mp3"])
def test_formats(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"tone.{suffix}"
    soundfile.write(path, tone(700, 1.2, 44100), 44100)
    assert loudest_frequency(read_sound(path)) == pytest.approx(700, abs=2)


def test_a_short_sound_is_looped_whole_and_an_offset_taken_away(tmp_path: Path) -> None:
    path = tmp_path / "short.wav"
    soundfile.write(path, 0.2 + tone(500, 0.3, RATE), RATE, subtype="FLOAT")
    samples = read_sound(path)
    assert len(samples) == 4 * 4800
    np.testing.assert_array_equal(samples[:4800], samples[4800:9600])
    assert abs(samples.mean()) < 1e-4


def test_the_home_directory_is_expanded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    soundfile.write(tmp_path / "tone.wav", tone(500, 1, RATE), RATE)
    assert len(read_sound("~/tone.wav")) == RATE


def test_hashes_follow_the_content_and_not_the_path(tmp_path: Path) -> None:
    for name, frequency in (("a", 500), ("b", 500), ("c", 600)):
        soundfile.write(tmp_path / f"{name}.wav", tone(frequency, 1, RATE), RATE)
    hashes = content_hash({name: str(tmp_path / f"{name}.wav") for name in "abc"} | {"d": "ring"})
    assert hashes["a"] == hashes["b"]
    assert len(set(hashes.values())) == 3
    assert content_hash({"x": "ring"})["x"] == hashes["d"]


def test_sounds_load_in_the_order_of_the_mapping() -> None:
    sounds = load_sounds({"second": "clock", "first": "alarm"})
    assert list(sounds) == ["second", "first"]
    np.testing.assert_array_equal(sounds["first"], read_sound("alarm"))


def cut(suffix: str) -> Callable[[Path], None]:
    """Writer of a file that lacks its second half."""

    def write(path: Path) -> None:
        whole = path.with_name(f"whole.{suffix}")
        noise = np.random.default_rng(0).uniform(-0.5, 0.5, 3 * RATE)
        soundfile.write(whole, noise, RATE)
        content = whole.read_bytes()
        path.write_bytes(content[: len(content) // 2])

    return write


def wave(samples: np.ndarray, rate: int = RATE) -> Callable[[Path], None]:
    """Writer of a float WAV file."""
    return lambda path: soundfile.write(path, samples, rate, format="WAV", subtype="FLOAT")


HOLED = np.where(np.arange(RATE) == 5, np.nan, tone(500, 1, RATE))
OPPOSED = np.stack([tone(500, 1, RATE), -tone(500, 1, RATE)], axis=1)
# A stream of which the writer did not know the length: nothing is missing.
STREAMED = {"RIFF": b"\xff\xff\xff\xff", "data": b"\xff\xff\xff\xff"}
BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (lambda path: None, "does not exist"),
    "folder": (lambda path: path.mkdir(), "is a folder"),
    "no bytes": (lambda path: path.write_bytes(b""), r"is empty \(0 bytes\)"),
    "no samples": (wave(np.zeros(0)), r"is empty \(0 samples\)"),
    "text": (lambda path: path.write_text("not a sound\n" * 50), "is not audio"),
    "zeros": (lambda path: path.write_bytes(bytes(5000)), "is not audio"),
    "wav header": (lambda path: path.write_bytes(b"RIFF\x24\x80\0\0WAVEfmt "), "is truncated"),
    "cut wav": (cut("wav"), "is truncated"),
    "cut aiff": (cut("aiff"), "is truncated"),
    "cut flac": (cut("flac"), "is truncated"),
    "cut ogg": (cut("ogg"), "is truncated"),
    "silent": (wave(np.zeros(RATE)), "is silent"),
    "offset alone": (wave(np.full(RATE, 0.3)), "is silent"),
    "channels cancel": (wave(OPPOSED), "is silent once mixed"),
    "too high": (wave(tone(15000, 1, 48000), 48000), "is silent below 8 kHz"),
    "not numbers": (wave(HOLED), "not numbers"),
    "infinite": (wave(np.where(np.isnan(HOLED), np.inf, HOLED)), "not numbers"),
    "few samples": (wave(tone(500, 0.005, RATE)), "is too short"),
    "odd rate": (wave(tone(5, 1, 100), 100), "sampling rate of 100 Hz"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_gives_one_line_that_names_it(tmp_path: Path, case: str) -> None:
    write, expected = BAD[case]
    path = tmp_path / "bad file.wav"
    write(path)
    with pytest.raises(UserError, match=expected) as caught:
        read_sound(path)
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    assert "; " in message  # and says what to do


def test_a_wav_file_of_unknown_length_is_not_truncated(tmp_path: Path) -> None:
    path = tmp_path / "piped.wav"
    soundfile.write(path, tone(500, 1, RATE), RATE)
    content = bytearray(path.read_bytes())
    for chunk, size in STREAMED.items():
        place = content.index(chunk.encode()) + 4
        content[place : place + 4] = size
    path.write_bytes(content)
    assert len(read_sound(path)) == RATE


def test_hashing_a_missing_file_is_a_user_error_too(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"ring, alarm, clock, another name .* or the path"):
        content_hash({"x": str(tmp_path / "rnig")})


@pytest.mark.parametrize("suffix", ["wav", "flac", "ogg", "aiff"])
def test_damaged_files_are_read_or_refused_but_never_crash(
    tmp_path: Path, suffix: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"noise.{suffix}"
    generator = np.random.default_rng(0)
    soundfile.write(path, generator.uniform(-0.5, 0.5, RATE), RATE)
    content = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    refusals = []
    for _ in range(40):
        damaged = content.copy()
        damaged[generator.integers(0, 200, 8)] = generator.integers(0, 256, 8)
        path.write_bytes(damaged.tobytes())
        try:
            assert np.isfinite(read_sound(path)).all()
        except UserError as error:
            refusals.append(str(error))
    assert len(refusals) > 5
    assert not any("\n" in missing_error for missing_error in refusals)
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("function", [load_sounds, content_hash])
def test_no_sound_at_all(function: Callable) -> None:
    with pytest.raises(UserError, match="no sound is named"):
        function({})


def test_quiet_and_huge_float_files_keep_their_shape(tmp_path: Path) -> None:
    samples = {}
    for name, factor in (("quiet", 1e-3), ("huge", 1e30)):
        path = tmp_path / f"{name}.wav"
        soundfile.write(path, factor * tone(500, 1, RATE), RATE, subtype="FLOAT")
        samples[name] = read_sound(path)
    np.testing.assert_allclose(samples["quiet"], samples["huge"], atol=1e-5)


@pytest.mark.parametrize("rate", [8000, 48000])
def test_a_sound_keeps_its_pitch_and_level_at_another_rate(tmp_path: Path, rate: int) -> None:
    path = tmp_path / "tone.wav"
    soundfile.write(path, tone(700, 1.5, 44100), 44100)
    samples = read_sound(path, rate)
    assert len(samples) == pytest.approx(1.5 * rate, abs=1)
    assert np.sqrt(np.mean(samples.astype(np.float64) ** 2)) == pytest.approx(1, abs=1e-4)
    spectrum = np.abs(np.fft.rfft(samples))
    assert np.fft.rfftfreq(len(samples), 1 / rate)[spectrum.argmax()] == pytest.approx(700, abs=2)


def test_what_a_low_rate_cannot_hold_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "high.wav"
    soundfile.write(path, tone(6000, 1, 48000), 48000)
    assert len(read_sound(path)) == RATE
    with pytest.raises(UserError, match="silent below 4 kHz; take one that microphones of 8 kHz"):
        read_sound(path, 8000)
