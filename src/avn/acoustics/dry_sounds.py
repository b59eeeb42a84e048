"""Dry sounds: recordings that sources emit, read from the package or from any audio file.

Every sound is converted to mono, one sampling rate, mean 0 and RMS 1, and is looped.
"""

import hashlib
import os
from collections.abc import Mapping, Sequence
from functools import cache
from math import gcd
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from avn.acoustics.audio_decoder import DecodingError, Recording, decode
from avn.acoustics.sound_names import BUILTIN
from avn.acoustics.sound_table import packaged_file, packaged_sounds
from avn.core.errors import UserError
from avn.core.progress import log

RATE = 16000  # default sampling rate, Hz

SHORTEST_SECONDS = 0.01
RATES = (1000, 768000)
SILENCE = 1e-5  # RMS, -100 dB of full scale
FULL_SCALE = 1 - 1.5 / 2**15  # of 16 bits
LONGEST_PEAK = 3  # samples at full scale in a row that are not yet clipping
CLIPPED = 0.001  # least share of clipped samples that is told
LEAST_KEPT = 0.01  # share of the RMS that has to be below half the sampling rate: -40 dB


def read_sound(path: str | bytes | Path, rate: int = RATE) -> NDArray[np.float32]:
    """Read any audio file as a dry sound.

    Parameters
    ----------
    path : str, bytes or Path
        A file of a format of docs/sounds.md (WAV, FLAC, OGG, MP3, M4A, AIFF, ...), of any sampling
        rate and any number of channels, or the name of a packaged sound (`packaged_sounds`). ``~``
        is the home directory. A packaged sound has precedence over a file of the same name.
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
        not finite. A clipped recording and a wrong header are told in a line.
    """
    path = os.fsdecode(path)
    mixed, file_rate = _decode(recording_bytes(path), path)
    mixed -= mixed.mean()
    loudness = _rms(mixed)
    if loudness < SILENCE:
        raise _error(path, "is silent once mixed to one channel", "take a recording that sounds")
    heard = _resampled(mixed, file_rate, rate)
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
        Name of the sound to the name of a packaged sound or the path of a file.
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
    _tell_replaced(mapping)
    return {name: read_sound(path, rate) for name, path in mapping.items()}


def check_sounds(mapping: Mapping[str, str], rate: int = RATE) -> None:
    """Raise `UserError` where `load_sounds` would.

    Parameters
    ----------
    mapping : mapping
        As for `load_sounds`.
    rate : int
        Sampling rate in Hz.

    Raises
    ------
    UserError
        If `read_sound` raises it, or the mapping is empty.
    """
    _require_sounds(mapping)
    _tell_replaced(mapping)
    for path in mapping.values():
        if path in packaged_sounds():
            _check_packaged(path, rate)
        else:
            read_sound(path, rate)


@cache  # a command checks the same sounds for several stages
def _check_packaged(name: str, rate: int) -> None:
    read_sound(name, rate)


def _tell_replaced(mapping: Mapping[str, str]) -> None:
    for name, path in mapping.items():
        if name in packaged_sounds() and path != name:
            _tell_once(f"sound '{name}': {_readable(str(path))}, in place of the built-in {name}")


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
    return {
        name: hashlib.sha256(recording_bytes(str(path))).hexdigest()
        for name, path in mapping.items()
    }


def _require_sounds(mapping: Mapping[str, str]) -> None:
    """Raise a `UserError` for a config without sounds."""
    if not mapping:
        raise UserError(f"sound: no sound is named; give {_choices()}")


def _choices() -> str:
    return f"{', '.join(BUILTIN)}, another name of docs/sounds.md or the path of an audio file"


def _error(path: str, wrong: str, remedy: str) -> UserError:
    return UserError(f"sound file {_readable(path)} {wrong}; {remedy}")


def _readable(path: str) -> str:
    """Return a path as text that can be written, also where its name is no valid UTF-8."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


@cache
def _tell_once(line: str) -> None:
    """Print a line, once in a process, since a sound is read several times."""
    log(line)


def recording_bytes(path: str) -> bytes:
    """Read the bytes of a packaged sound or of a file.

    Raises
    ------
    UserError
        If the file is missing, a folder, empty or cannot be read.
    """
    if path in packaged_sounds():
        return packaged_file(path).read_bytes()
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


def _decode(content: bytes, path: str) -> tuple[NDArray[np.float64], int]:
    """Decode an audio file to one channel and a rate in Hz; raise for a bad one."""
    try:
        recordings = decode(content)
    except DecodingError as error:
        is_known = str(error).startswith("is truncated")
        remedy = "copy or convert it again" if is_known else "convert it to WAV, FLAC or OGG"
        raise _error(path, str(error), remedy) from None
    rate = recordings[0].rate
    if not all(RATES[0] <= recording.rate <= RATES[1] for recording in recordings):
        raise _error(path, f"has a sampling rate of {rate} Hz", "convert it to 16000 Hz")
    _require_sound_samples(recordings, path)
    for recording in recordings:
        _remark(recording, path)
    mixed = [_resampled(one.samples.mean(axis=1), one.rate, rate) for one in recordings]
    return (mixed[0] if len(mixed) == 1 else np.concatenate(mixed)), rate


def _resampled(samples: NDArray[np.float64], rate: int, wanted: int) -> NDArray[np.float64]:
    from scipy.signal import resample_poly

    common = gcd(rate, wanted)
    heard: NDArray[np.float64] = resample_poly(samples, wanted // common, rate // common)
    return heard


def _require_sound_samples(recordings: Sequence[Recording], path: str) -> None:
    """Raise a `UserError` for recordings that are empty, too short or not finite."""
    count = sum(len(recording.samples) for recording in recordings)
    if not count:
        raise _error(path, "is empty (0 samples)", "take a recording that sounds")
    if sum(len(recording.samples) / recording.rate for recording in recordings) < SHORTEST_SECONDS:
        wrong = f"is too short ({count} samples at {recordings[0].rate} Hz)"
        raise _error(path, wrong, f"take one of at least {1000 * SHORTEST_SECONDS:.0f} ms")
    if not all(np.isfinite(recording.samples).all() for recording in recordings):
        raise _error(path, "has samples that are not numbers (NaN or infinite)", "export it again")


def _remark(recording: Recording, path: str) -> None:
    """Print a line for a recording that is clipped, or whose header is wrong."""
    if recording.remark:
        _tell_once(f"sound file {_readable(path)} {recording.remark}")
    share = _clipped(recording.samples)
    if share >= CLIPPED:
        _tell_once(
            f"sound file {_readable(path)} is clipped: {100 * share:.1f} % of its samples are at "
            "full scale; it is used as it is, record it at a lower level for a clean sound"
        )


def _clipped(samples: NDArray[np.float64]) -> float:
    """Return the share of samples in long runs at full scale; 0 for float files beyond it."""
    from scipy.ndimage import binary_opening

    level = np.abs(samples)
    if not len(level) or level.max() > 2:
        return 0.0
    at_top = level >= FULL_SCALE
    # runs of more than LONGEST_PEAK samples: those that survive an opening by that length
    kept = binary_opening(at_top, np.ones((LONGEST_PEAK + 1, 1), dtype=bool))
    return float(kept.mean())


def _rms(samples: NDArray[np.float64]) -> float:
    # Scaling by the peak first keeps float files of extreme level from over- or underflowing.
    peak = float(np.abs(samples).max())
    return peak * float(np.sqrt(np.mean((samples / peak) ** 2))) if peak > 0 else 0.0
