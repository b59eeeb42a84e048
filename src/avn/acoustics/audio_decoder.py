"""Decoding of audio files: by libsndfile, and by FFmpeg for what libsndfile cannot read."""

from __future__ import annotations

import io
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray

from avn.acoustics.audio_files import parts_of
from avn.acoustics.audio_part import Part

# Only these formats, since a playlist could name other files. Any error ends the decoding.
_OPTIONS = (
    *("-nostdin", "-v", "error", "-xerror", "-protocol_whitelist", "file,pipe"),
    *("-format_whitelist", "aac,aiff,au,caf,flac,mov,mp3,ogg,w64,wav"),
)
_OUTPUT = ("-map", "0:a:0", "-c:a", "pcm_f64le", "-f", "wav", "pipe:1")
# Most samples by which a codec's delay and padding, which are left out, shorten a recording.
_PADDING = 4096
# Number of samples that libsndfile gives for a stream of unknown length, or more.
_UNKNOWN = 2**40


class DecodingError(Exception):
    """Content that is not a whole recording; the message is a phrase, such as `is truncated`."""


@dataclass(frozen=True)
class Recording:
    """Decoded recording.

    Attributes
    ----------
    samples : float64 array, shape (n, channels)
        Samples; full scale is 1.
    rate : int
        Sampling rate in Hz.
    remark : str, optional
        Phrase about a header that is wrong.
    """

    samples: NDArray[np.float64]
    rate: int
    remark: str | None = None


def decode(content: bytes) -> list[Recording]:
    """Decode all recordings of an audio file to their ends.

    Parameters
    ----------
    content : bytes
        Content of the file.

    Returns
    -------
    list of Recording
        Most files have one; several where files were joined end to end.

    Raises
    ------
    DecodingError
        If a recording is truncated, damaged or of an unknown format.
    """
    return [_decode(part) for part in parts_of(content)]


def _decode(part: Part) -> Recording:
    """Decode one recording and compare its length with what its container says."""
    if part.lost is not None:
        raise DecodingError(f"is truncated ({part.lost})")
    try:
        samples, rate, expected = _by_libsndfile(part.content)
    except (soundfile.SoundFileError, RuntimeError, TypeError, ValueError, MemoryError) as error:
        samples, rate = _by_ffmpeg(part, _short(error))
        expected = 0
    if part.present is not None and len(samples) < part.present - _PADDING:
        samples, rate = _by_ffmpeg(part, "its frames cannot be decoded")
    if part.present is not None:
        expected = part.present - _PADDING
    elif part.promised is not None:
        expected = part.promised
    if len(samples) < expected:
        raise DecodingError(f"is truncated ({len(samples)} of {expected} samples are there)")
    remark = None
    if part.promised is not None and len(samples) > part.promised:
        remark = f"has {len(samples)} samples, which are read; its header says {part.promised}"
    return Recording(samples, rate, remark)


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


class _Straight(soundfile.SoundFile):
    """Sound file that is read once from its start, without seeks: some codecs have none."""

    def seekable(self) -> bool:
        """Return False."""
        return False


def _by_libsndfile(content: bytes) -> tuple[NDArray[np.float64], int, int]:
    """Return the samples (n, channels), the rate in Hz, and the number that its header gives."""
    length = 2**20
    while True:
        with _Straight(_Seekable(content)) as file:
            is_known = file.frames < _UNKNOWN
            wanted = file.frames if is_known else length
            samples = file.read(wanted, dtype="float64", always_2d=True)
            if is_known or len(samples) < length:
                return samples, file.samplerate, file.frames if is_known else 0
        length *= 16


def _by_ffmpeg(part: Part, reason: str) -> tuple[NDArray[np.float64], int]:
    """Decode with FFmpeg; `reason` says why libsndfile could not, for the message."""
    import imageio_ffmpeg  # slow to import, and seldom needed

    try:
        program = imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError:
        raise DecodingError(f"is not audio that can be read without FFmpeg ({reason})") from None
    with tempfile.TemporaryDirectory(prefix="avn-sound-") as folder:
        path = Path(folder) / "recording"  # a file, since MP4 needs seeks
        path.write_bytes(part.content)
        # FFmpeg would remove the padding of ALAC in CAF twice
        options = ("-flags2", "+skip_manual") if part.content[:4] == b"caff" else ()
        given = (*_OPTIONS, *options, "-i", f"file:{path}")
        result = subprocess.run([program, *given, *_OUTPUT], capture_output=True, check=False)
    try:
        samples, rate, _ = _by_libsndfile(parts_of(result.stdout)[0].content)
    except soundfile.SoundFileError:
        raise DecodingError(f"is not audio that can be read ({reason})") from None
    if result.returncode or result.stderr:
        total = f" of {part.promised}" if part.promised else ""
        raise DecodingError(f"is truncated or damaged ({len(samples)}{total} samples can be read)")
    return samples, rate


def _short(error: Exception) -> str:
    """Return the message of libsndfile's error on one line, without the name of the stream."""
    text = str(getattr(error, "error_string", error))
    return " ".join(text.split()).rstrip(".") or type(error).__name__
