"""Dry sounds: recordings that sources emit, read from the package or from any audio file.

Every sound is converted to mono, one sampling rate, mean 0 and RMS 1, and is looped.
"""

import hashlib
import io
from collections.abc import Mapping
from importlib import resources
from math import gcd
from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray

from avn.acoustics.audio_files import missing_part
from avn.core.errors import UserError

RATE = 16000  # default sampling rate, Hz
BUILTIN = ("ring", "alarm", "clock")

SHORTEST_SECONDS = 0.01
RATES = (1000, 768000)
SILENCE = 1e-5  # RMS, -100 dB of full scale
LEAST_KEPT = 0.01  # share of the RMS that has to be below half the sampling rate: -40 dB


def read_sound(path: str | Path, rate: int = RATE) -> NDArray[np.float32]:
    """Read any audio file as a dry sound.

    Parameters
    ----------
    path : str or Path
        A file that libsndfile reads (WAV, FLAC, OGG, MP3, AIFF, ...), of any sampling rate and any
        number of channels, or one of ``BUILTIN``. ``~`` is the home directory. The name of a
        built-in sound has precedence over a file of the same name.
    rate : int
        Sampling rate of the result in Hz.

    Returns
    -------
    float32 array, shape (n,)
        The mean of the channels at that rate, of mean 0 and RMS 1. A recording shorter than a
        second is repeated to fill one, so n >= rate.

    Raises
    ------
    UserError
        If the file is missing, a folder, empty, not audio, truncated, shorter than 10 ms, silent
        (as a whole, after mixing of its channels, or below half the rate), or has samples that are
        not finite.
    """
    from scipy.signal import resample_poly

    content = _content(str(path))
    samples, file_rate = _decode(content, str(path))
    mixed = samples.mean(axis=1)
    mixed -= mixed.mean()
    loudness = _rms(mixed)
    if loudness < SILENCE:
        raise _error(path, "is silent once mixed to one channel", "take a recording that sounds")
    common = gcd(rate, file_rate)
    heard = resample_poly(mixed, rate // common, file_rate // common)
    heard -= heard.mean()
    if _rms(heard) < LEAST_KEPT * loudness:
        wrong = f"is silent below {rate / 2000:g} kHz"
        raise _error(path, wrong, f"take one that microphones of {rate / 1000:g} kHz can hear")
    heard /= _rms(heard)
    return np.tile(heard, -(-rate // len(heard))).astype(np.float32)


def load_sounds(mapping: Mapping[str, str], rate: int = RATE) -> dict[str, NDArray[np.float32]]:
    """Read the sounds of the config node `sound`.

    Parameters
    ----------
    mapping : mapping
        Name of the sound to the name of a built-in sound or the path of a file.
    rate : int
        Sampling rate of the result in Hz.

    Returns
    -------
    dict
        Name to the array of `read_sound`, in the order of the mapping.

    Raises
    ------
    UserError
        If `read_sound` raises it, or the mapping is empty.
    """
    _require_sounds(mapping)
    return {name: read_sound(path, rate) for name, path in mapping.items()}


def content_hash(mapping: Mapping[str, str]) -> dict[str, str]:
    """Hash the content of the sounds, independently of the files' paths.

    Parameters
    ----------
    mapping : mapping
        As for `load_sounds`.

    Returns
    -------
    dict
        Name to the SHA-256 of the file's bytes in hexadecimal.

    Raises
    ------
    UserError
        If a file is missing, a folder, empty or cannot be read, or the mapping is empty.
    """
    _require_sounds(mapping)
    return {name: hashlib.sha256(_content(str(path))).hexdigest() for name, path in mapping.items()}


def _require_sounds(mapping: Mapping[str, str]) -> None:
    """Raise a `UserError` for a config without sounds."""
    if not mapping:
        raise UserError(f"sound: no sound is named; give {_choices()}")


def _choices() -> str:
    return f"{', '.join(BUILTIN)} or the path of an audio file"


def _error(path: str | Path, wrong: str, remedy: str) -> UserError:
    return UserError(f"sound file {path} {wrong}; {remedy}")


def _content(path: str) -> bytes:
    """Read the bytes of a built-in sound or of a file."""
    if path in BUILTIN:
        return (resources.files("avn") / "assets" / "dry_sounds" / f"{path}.flac").read_bytes()
    try:
        file = Path(path).expanduser()
        if file.exists() and not (file.is_file() or file.is_dir()):
            raise _error(path, "is no file but a device or pipe", f"give {_choices()}")
        content = file.read_bytes()
    except FileNotFoundError:
        raise _error(path, "does not exist", f"give {_choices()}") from None
    except IsADirectoryError:
        raise _error(path, "is a folder", "give the path of one audio file") from None
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise _error(path, f"cannot be read ({reason})", f"give {_choices()}") from None
    if not content:
        raise _error(path, "is empty (0 bytes)", "take a recording that sounds")
    return content


class _Seekable(io.BytesIO):
    """Stream of bytes that ignores seeks to before its start, which damaged headers cause.

    libsndfile seeks through callbacks that cannot raise: an exception there is only printed.
    """

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        """See `io.BytesIO.seek`."""
        try:
            return super().seek(offset, whence)
        except ValueError:
            return self.tell()


def _decode(content: bytes, path: str) -> tuple[NDArray[np.float64], int]:
    """Decode an audio file to samples (n, channels) and a rate in Hz; raise for a bad one."""
    lost = missing_part(content)
    again = "copy or convert it again"
    try:
        file = soundfile.SoundFile(_Seekable(content))
    except (soundfile.SoundFileError, RuntimeError, TypeError, ValueError) as error:
        if lost is not None:
            raise _error(path, f"is truncated ({lost})", again) from None
        remedy = "convert it to WAV, FLAC or OGG"
        raise _error(path, f"is not audio that can be read ({_short(error)})", remedy) from None
    with file:
        promised, rate = file.frames, file.samplerate
        try:
            samples = file.read(dtype="float64", always_2d=True)
        except (soundfile.SoundFileError, RuntimeError, ValueError, MemoryError) as error:
            raise _error(path, f"is truncated or damaged ({_short(error)})", again) from None
    if lost is None and len(samples) < promised:
        lost = f"{len(samples)} of {promised} samples are there"
    if lost is not None:
        raise _error(path, f"is truncated ({lost})", again)
    if not RATES[0] <= rate <= RATES[1]:
        raise _error(path, f"has a sampling rate of {rate} Hz", "convert it to 16000 Hz")
    _require_sound_samples(samples, rate, path)
    return samples, rate


def _require_sound_samples(samples: NDArray[np.float64], rate: int, path: str) -> None:
    """Raise a `UserError` for a recording that is empty, too short or not finite."""
    if not len(samples):
        raise _error(path, "is empty (0 samples)", "take a recording that sounds")
    if len(samples) < SHORTEST_SECONDS * rate:
        wrong = f"is too short ({len(samples)} samples at {rate} Hz)"
        raise _error(path, wrong, f"take one of at least {1000 * SHORTEST_SECONDS:.0f} ms")
    if not np.isfinite(samples).all():
        raise _error(path, "has samples that are not numbers (NaN or infinite)", "export it again")


def _short(error: Exception) -> str:
    """Return the message of a library's error on one line."""
    return " ".join(str(error).split()).rstrip(".") or type(error).__name__


def _rms(samples: NDArray[np.float64]) -> float:
    # Scaling by the peak first keeps float files of extreme level from over- or underflowing.
    peak = float(np.abs(samples).max())
    return peak * float(np.sqrt(np.mean((samples / peak) ** 2))) if peak > 0 else 0.0
