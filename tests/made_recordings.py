"""Audio files of known content in memory, written by libsndfile, by FFmpeg or byte by byte."""

import io
import struct
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import soundfile

RATE = 44100


def chirp(rate=RATE, seconds=1.0, first=300, last=2500):
    """A tone of rising or falling frequency, whose place in time can be told."""
    t = np.arange(round(rate * seconds)) / rate
    return 0.5 * np.sin(2 * np.pi * (first * t + (last - first) / (2 * seconds) * t * t))


@lru_cache(maxsize=128)
def by_libsndfile(kind, subtype=None, rate=RATE, endian=None):
    """A file of `chirp(rate)`."""
    buffer = io.BytesIO()
    soundfile.write(buffer, chirp(rate), rate, format=kind, subtype=subtype, endian=endian)
    return buffer.getvalue()


@lru_cache(maxsize=128)
def by_ffmpeg(*options, rate=RATE, pipe=False):
    """A file of `chirp(rate)`, written to a file or to a pipe."""
    given = ("-v", "error", "-y", "-f", "f64le", "-ar", str(rate), "-ac", "1", "-i", "pipe:0")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "made"
        result = subprocess.run(
            [imageio_ffmpeg.get_ffmpeg_exe(), *given, *options, "pipe:1" if pipe else str(path)],
            input=chirp(rate).astype("<f8").tobytes(),
            capture_output=True,
            check=True,
        )
        return result.stdout if pipe else path.read_bytes()


def mp3(*options, pipe=False):
    """An MP3 file of variable bitrate, or as the options say."""
    return by_ffmpeg("-c:a", "libmp3lame", *(options or ("-q:a", "4")), "-f", "mp3", pipe=pipe)


def headless_mp3():
    """An MP3 file of variable bitrate without the header that counts its frames."""
    return mp3("-q:a", "4", "-write_xing", "0")


def patched(content, place, value):
    """The content with other bytes at a place."""
    return content[:place] + value + content[place + len(value) :]


def open_wav(riff, data, content=None):
    """A WAV file whose two sizes were never written, as from a pipe."""
    content = content or by_libsndfile("WAV")
    place = content.index(b"data") + 4
    return patched(patched(content, 4, struct.pack("<I", riff)), place, struct.pack("<I", data))


def id3(size):
    """An ID3v2 tag of a picture of some bytes, among them the mark of MP3 frames."""
    body = b"APIC" + bytes([*_synchsafe(size)]) + b"\0\0" + (b"\xff\xfb\x90\x64" * size)[:size]
    return b"ID3\x04\0\0" + bytes(_synchsafe(len(body))) + body


def _synchsafe(size):
    return [size >> shift & 127 for shift in (21, 14, 7, 0)]


def xing_count(content, count):
    """An MP3 file with another number of frames in its header."""
    return patched(content, content.index(b"Xing") + 8, struct.pack(">I", count))


def flac_total(content, total):
    """A FLAC file with another number of samples in its header."""
    bits = int.from_bytes(content[18:26], "big")
    return patched(content, 18, (bits >> 36 << 36 | total).to_bytes(8, "big"))


def with_list(content, padding):
    """A WAV file with a LIST chunk of odd size before the sound, and some padding after it."""
    place = content.index(b"data")
    return content[:place] + b"LIST\x0f\0\0\0INFOISFT\3\0\0\0abc"[:23] + padding + content[place:]
