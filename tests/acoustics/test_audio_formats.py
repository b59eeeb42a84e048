"""Formats of audio files: whole ones are read to their ends, truncated ones are refused.

The truth is the signal that was written. The formats are those of the table in docs/sounds.md.
"""

import re
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
from made_recordings import (
    RATE,
    by_ffmpeg,
    by_libsndfile,
    chirp,
    flac_total,
    headless_mp3,
    id3,
    mp3,
    open_wav,
    patched,
    with_list,
    xing_count,
)
from scipy.signal import correlate, resample_poly

from avn.acoustics.audio_decoder import DecodingError, decode
from avn.acoustics.dry_sounds import read_sound
from avn.core.errors import UserError

DOCS = Path(__file__).parents[2] / "docs" / "sounds.md"
WAV_CODECS = ("PCM_16", "PCM_24", "PCM_U8", "FLOAT", "DOUBLE", "ULAW", "ALAW", "IMA_ADPCM")
FORMATS = {
    "WAV": [
        *(lambda codec=codec: by_libsndfile("WAV", codec) for codec in WAV_CODECS),
        lambda: by_libsndfile("WAVEX"),
        lambda: by_libsndfile("WAV", "PCM_16", RATE, "BIG"),
        lambda: by_libsndfile("WAV", "GSM610", 8000),
        lambda: by_ffmpeg("-c:a", "libmp3lame", "-f", "wav"),
    ],
    "RF64, BW64": [
        lambda: by_libsndfile("RF64"),
        lambda: by_ffmpeg("-rf64", "always", "-f", "wav"),
    ],
    "W64": [lambda: by_libsndfile("W64"), lambda: by_ffmpeg("-f", "w64")],
    "AIFF, AIFC": [lambda: by_libsndfile("AIFF"), lambda: by_libsndfile("AIFF", "ULAW")],
    "AU": [
        lambda: by_libsndfile("AU"),
        lambda: by_libsndfile("AU", "PCM_16", RATE, "LITTLE"),
    ],
    "CAF": [lambda: by_libsndfile("CAF"), lambda: by_ffmpeg("-c:a", "alac", "-f", "caf")],
    "FLAC": [lambda: by_libsndfile("FLAC")],
    "OGG Vorbis": [lambda: by_libsndfile("OGG", "VORBIS")],
    "OGG Opus": [lambda: by_libsndfile("OGG", "OPUS", 48000)],
    "OGG FLAC": [lambda: by_ffmpeg("-c:a", "flac", "-f", "ogg")],
    "MP3": [mp3, lambda: mp3("-b:a", "128k"), headless_mp3],
    "MP2": [lambda: by_ffmpeg("-c:a", "mp2", "-f", "mp2")],
    "M4A, MP4": [
        lambda: by_ffmpeg("-c:a", "aac", "-f", "ipod"),
        lambda: by_ffmpeg("-c:a", "alac", "-movflags", "faststart", "-f", "ipod"),
    ],
    "AAC": [lambda: by_ffmpeg("-c:a", "aac", "-f", "adts")],
}
EACH = [
    pytest.param(make, id=f"{name}-{number}")
    for name, makers in FORMATS.items()
    for number, make in enumerate(makers)
]
PIPES = {
    "wav 0": lambda: open_wav(0, 0),
    "wav sox": lambda: open_wav(0x7FFFF024, 0x7FFFF000),
    "wav arecord": lambda: open_wav(0x80000024, 0x80000000),
    "wav ffmpeg": lambda: by_ffmpeg("-f", "wav", pipe=True),
    "wav 2**32 less a header": lambda: open_wav(0xFFFFFFFF, 0xFFFFFFFF - 36),
    "wav adpcm": lambda: open_wav(2**32 - 1, 2**32 - 1, by_libsndfile("WAV", "IMA_ADPCM")),
    "rf64": lambda: by_ffmpeg("-rf64", "always", "-f", "wav", pipe=True),
    "w64": lambda: by_ffmpeg("-f", "w64", pipe=True),
    "caf": lambda: by_ffmpeg("-c:a", "pcm_s16be", "-f", "caf", pipe=True),
    "au": lambda: by_ffmpeg("-c:a", "pcm_s16be", "-f", "au", pipe=True),
    "aiff": lambda: by_ffmpeg("-c:a", "pcm_s16be", "-f", "aiff", pipe=True),
    "flac": lambda: by_ffmpeg("-c:a", "flac", "-f", "flac", pipe=True),
    "ogg flac": lambda: by_ffmpeg("-c:a", "flac", "-f", "ogg", pipe=True),
    "mp3": lambda: mp3("-b:a", "128k", pipe=True),
    "mp4": lambda: by_ffmpeg(
        "-c:a", "aac", "-movflags", "frag_keyframe+empty_moov", "-f", "mp4", pipe=True
    ),
}
WRONG = {
    "mp3 fewer": lambda: xing_count(mp3(), 12),
    "mp3 none": lambda: xing_count(mp3(), 0),
    "flac fewer": lambda: flac_total(by_libsndfile("FLAC"), 9000),
    "flac none": lambda: flac_total(by_libsndfile("FLAC"), 0),
    "mp3 picture": lambda: id3(50_000) + headless_mp3(),
    "mp3 ID3v1": lambda: headless_mp3() + b"TAG" + bytes(125),
    "mp3 tag at the end": lambda: mp3() + id3(500),
    "mp3 in a wav from a pipe": lambda: open_wav(
        0, 0, by_ffmpeg("-c:a", "libmp3lame", "-f", "wav")
    ),
    "wav one byte short": lambda: by_libsndfile("WAV")[:-1],
    "wav padded LIST": lambda: with_list(by_libsndfile("WAV"), b"\0"),
    "wav unpadded LIST": lambda: with_list(by_libsndfile("WAV"), b""),
    "wav RIFF size": lambda: patched(by_libsndfile("WAV"), 4, struct.pack("<I", 1)),
}


def decoded(content):
    """All samples of a file as one channel, at RATE."""
    parts = [
        resample_poly(one.samples.mean(axis=1), RATE, one.rate)
        if one.rate != RATE
        else one.samples.mean(axis=1)
        for one in decode(content)
    ]
    return np.concatenate(parts)


def assert_is(found, truth):
    """Assert that a signal is the truth but for a codec's noise, delay and padding."""
    assert abs(len(found) - len(truth)) < 3000
    match = correlate(found, truth, method="fft").max()
    assert match / np.sqrt((found @ found) * (truth @ truth)) > 0.85  # of half: 0.71


def test_the_table_of_the_docs_is_that_of_the_tests():
    rows = re.findall(r"^\| ([^|]+?) \| `\.", DOCS.read_text(), flags=re.M)
    assert rows == list(FORMATS)


@pytest.mark.parametrize("make", EACH)
def test_whole_files_are_read_and_truncated_ones_refused(make):
    content = make()
    assert_is(decoded(content), chirp())
    for share in (0.3, 0.85):
        with pytest.raises(DecodingError, match=r"is truncated .*\d"):
            decode(content[: int(share * len(content))])


@pytest.mark.parametrize("case", PIPES)
def test_files_from_pipes_are_whole(case):
    assert_is(decoded(PIPES[case]()), chirp())


@pytest.mark.parametrize("case", WRONG)
def test_decoders_are_believed_where_headers_are_wrong(case):
    assert_is(decoded(WRONG[case]()), chirp())


@pytest.mark.parametrize("size", [1001, 2000])
@pytest.mark.parametrize("kind", ["WAV", "RF64", "W64", "AIFF", "AU", "CAF", "FLAC"])
def test_an_id3_tag_before_the_file_takes_nothing_from_it(kind, size):
    content = by_libsndfile(kind)
    np.testing.assert_array_equal(decoded(id3(size) + content), decoded(content))


@pytest.mark.parametrize(
    "make",
    [
        mp3,
        lambda: by_libsndfile("OGG", "VORBIS"),
        lambda: by_libsndfile("OGG", "OPUS", 48000),
        lambda: by_ffmpeg("-c:a", "flac", "-f", "ogg"),
        lambda: by_libsndfile("WAV"),
        lambda: by_libsndfile("W64"),
        lambda: by_libsndfile("AIFF"),
        lambda: by_libsndfile("AU"),
        lambda: by_libsndfile("CAF"),
        lambda: by_libsndfile("FLAC"),
    ],
)
def test_files_one_after_the_other_are_all_read(make):
    content = make()
    once, twice = decoded(content), decoded(content + content)
    np.testing.assert_array_equal(twice, np.concatenate([once, once]))
    with pytest.raises(DecodingError, match="truncated"):
        decode(content + content[: int(0.6 * len(content))])


def test_streams_of_unlike_rates_are_joined_at_the_first_rate(tmp_path):
    path = tmp_path / "joined.ogg"
    low, high = (by_libsndfile("OGG", "VORBIS", rate) for rate in (22050, 44100))
    path.write_bytes(low + high)
    assert len(read_sound(path)) == pytest.approx(32000, abs=2)


def test_a_gap_within_an_ogg_stream_is_refused():
    content = by_ffmpeg("-c:a", "libvorbis", "-page_duration", "100000", "-f", "ogg")
    pages = [match.start() for match in re.finditer(b"OggS", content)]
    with pytest.raises(DecodingError, match="in the middle of its stream"):
        decode(content[: pages[4]] + content[pages[5] :])


def test_common_files_are_read_without_another_process(monkeypatch):
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("a process was started"))
    for content in (
        *(by_libsndfile(kind) for kind in ("WAV", "FLAC", "AIFF")),
        by_libsndfile("OGG", "VORBIS"),
        open_wav(0, 0),
    ):
        assert len(decoded(content)) == RATE


def test_a_playlist_reads_no_other_file(tmp_path):
    (tmp_path / "other.wav").write_bytes(by_libsndfile("WAV"))
    path = tmp_path / "list.wav"
    path.write_text(f"ffconcat version 1.0\nfile '{tmp_path}/other.wav'\n")
    with pytest.raises(UserError, match="not audio that can be read"):
        read_sound(path)


@pytest.mark.parametrize("content", [b"not a sound " * 99, b"RIFF\x24\x80\0\0WAVEfmt ", b"ID3"])
def test_messages_name_the_file_and_no_object(tmp_path, content):
    path = tmp_path / "mine.wav"
    path.write_bytes(content)
    with pytest.raises(UserError, match=re.escape(f"sound file {path} is ")) as caught:
        read_sound(path)
    assert " at 0x" not in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_name_that_is_no_text_is_read_and_named(tmp_path):
    path = bytes(tmp_path) + b"/bell\xff.wav"
    with pytest.raises(UserError, match=r"bell\\xff.wav does not exist") as caught:
        read_sound(path)
    str(caught.value).encode()
    with open(path, "wb") as file:
        file.write(by_libsndfile("WAV"))
    assert len(read_sound(path)) == 16000


@pytest.mark.parametrize(
    ("gain", "frequency", "is_told"), [(1, 440, False), (2, 100, False), (3, 440, True)]
)
def test_clipping_is_told_once(tmp_path, capsys, gain, frequency, is_told):
    path = tmp_path / "loud.wav"
    tone = 0.5 * np.sin(2 * np.pi * frequency * np.arange(RATE) / RATE)
    pcm = np.round(32767 * np.clip(gain * tone, -1, 1)).astype("<i2")
    head = struct.pack(
        "<4sI8sIHHIIHH4sI", b"RIFF", 0, b"WAVEfmt ", 16, 1, 1, RATE, 0, 2, 16, b"data", 0
    )
    path.write_bytes(head + pcm.tobytes())
    read_sound(path)
    read_sound(path)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == is_told
    assert all(f"{path} is clipped" in line for line in lines)


def test_a_wrong_header_is_told(tmp_path, capsys):
    path = tmp_path / "wrong.flac"
    path.write_bytes(flac_total(by_libsndfile("FLAC"), 9000))
    read_sound(path)
    assert "has 44100 samples, which are read; its header says 9000" in capsys.readouterr().out


@pytest.mark.parametrize("kind", ["W64", "CAF", "AU", "MP3"])
def test_damage_gives_decoding_errors_alone(kind):
    generator = np.random.default_rng(0)
    refusals = []
    for _ in range(10):
        damaged = np.frombuffer(by_libsndfile(kind), dtype=np.uint8).copy()
        damaged[generator.integers(0, 120, 6)] = generator.integers(0, 256, 6)
        try:
            decode(damaged[: generator.integers(len(damaged))].tobytes())
        except DecodingError as error:
            refusals.append(str(error))
    assert len(refusals) > 5
    assert not any("\n" in refusal for refusal in refusals)
