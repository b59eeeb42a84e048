"""Containers of audio files: the recordings in a file, and how much of each is there.

Decoders shorten truncated files without a word, believe headers that are wrong, and refuse headers
that were never completed because the writer could not seek. The lengths of the containers are
therefore read here, and headers are corrected before a decoder sees them.
"""

from __future__ import annotations

from avn.acoustics import audio_chunks, audio_frames
from avn.acoustics.audio_part import Part

_FLAC = b"fLaC"
# Start of a FLAC stream: the mark and the header of STREAMINFO, which may be the only block.
_FLAC_STARTS = (b"fLaC\0\0\0\x22", b"fLaC\x80\0\0\x22")
_FLAC_TOTAL = slice(18, 26)  # sampling rate, channels, bits, and the total in the last 36 bits
_AU = {b".snd": "big", b"dns.": "little"}
_BOXES = (b"ftyp", b"styp", b"moov", b"mdat", b"free", b"skip", b"wide")


def parts_of(content: bytes) -> list[Part]:
    """Split the content of an audio file into its recordings.

    Files that were written one after the other into one file are several recordings.

    Parameters
    ----------
    content : bytes
        Content of the file.

    Returns
    -------
    list of Part
        At least one recording; content of an unknown format is one as it is.
    """
    parts: list[Part] = []
    start = 0
    while start < len(content) and (start == 0 or _begins(content, start)):
        start = _after_tags(content, start)
        if parts and not _begins(content, start):
            break  # a tag at the end of the file
        if start > len(content):
            size = start - len(content)
            return [
                *parts,
                Part(b"", lost=f"{size} bytes of its ID3 tag and all sound are missing"),
            ]
        part, end = _part(content, start)
        parts.append(part)
        start = max(end, start + 1)
    return parts or [Part(content)]


def _begins(content: bytes, start: int) -> bool:
    """Return whether another recording begins at a place."""
    head = content[start : start + 12]
    return (
        head[:3] == b"ID3"
        or head[:4] in (b"OggS", *_AU)
        or head.startswith(_FLAC_STARTS)
        or head[4:8] == b"ftyp"
        or audio_chunks.layout_of(content, start) is not None
        or audio_frames.is_frame(content, start)
    )


def _after_tags(content: bytes, start: int) -> int:
    """Return the place after the ID3v2 tags at a place."""
    while content[start : start + 3] == b"ID3" and start + 10 <= len(content):
        flags, *size = content[start + 5 : start + 10]
        footer = 10 * bool(flags & 0x10)
        start += (
            10 + footer + sum(one << shift for one, shift in zip(size, (21, 14, 7, 0), strict=True))
        )
    return start


def _part(content: bytes, start: int) -> tuple[Part, int]:
    """Return the recording at a place, and the place of its end."""
    layout = audio_chunks.layout_of(content, start)
    if layout is not None:
        return audio_chunks.read_chunks(content, start, layout)
    head = content[start : start + 8]
    if head[:4] in _AU:
        return _au(content, start)
    if head[:4] == b"OggS":
        return audio_frames.read_pages(content, start)
    if head[:4] == _FLAC:
        return _flac(content, start)
    if head[4:8] in _BOXES:
        return _boxes(content, start)
    return audio_frames.read_frames(content, start)


def _au(content: bytes, start: int) -> tuple[Part, int]:
    """Read the header of an AU file."""
    order = _AU[content[start : start + 4]]
    if start + 24 > len(content):
        return Part(content[start:], lost="it ends before the sound begins"), len(content)
    offset, size = (
        int.from_bytes(content[start + at : start + at + 4], order)  # type: ignore[arg-type]
        for at in (4, 8)
    )
    present = len(content) - start - offset
    if audio_chunks.is_open(size, 32, present):
        known = content[start : start + 8] + b"\xff" * 4 + content[start + 12 :]
        return Part(known), len(content)
    if present < size:
        lost = f"{max(present, 0)} of {size} bytes of sound are there"
        return Part(content[start:], lost=lost), len(content)
    return Part(content[start : start + offset + size]), start + offset + size


def _flac(content: bytes, start: int) -> tuple[Part, int]:
    """Take the length out of the header of a FLAC file, so that it is decoded to its end."""
    places = [content.find(mark, start + 4) for mark in _FLAC_STARTS]
    end = min((place for place in places if place >= 0), default=len(content))
    stream = content[start:end]
    bits = int.from_bytes(stream[_FLAC_TOTAL], "big")
    total = bits & (2**36 - 1)
    unknown = (bits - total).to_bytes(8, "big")
    known = stream[: _FLAC_TOTAL.start] + unknown + stream[_FLAC_TOTAL.stop :]
    return Part(known if len(stream) > 42 else stream, promised=total or None), end


def _boxes(content: bytes, start: int) -> tuple[Part, int]:
    """Walk the outer boxes of an MP4 file."""
    place = start
    while place + 8 <= len(content):
        size = int.from_bytes(content[place : place + 4], "big")
        name = content[place + 4 : place + 8]
        if name == b"ftyp" and place > start:
            break
        if size == 1:
            size = int.from_bytes(content[place + 8 : place + 16], "big")
        if size == 0:  # up to the end of the file
            size = len(content) - place
        if size < 8:
            break
        if place + size > len(content):
            lost = f"{len(content) - start} of at least {place + size - start} bytes are there"
            return Part(content[start:], lost=lost), len(content)
        place += size
    return Part(content[start:place]), place
