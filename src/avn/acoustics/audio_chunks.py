"""Files of chunks, each with a name and a size: WAV, RF64, RIFX, W64, AIFF and CAF."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from avn.acoustics.audio_frames import read_frames
from avn.acoustics.audio_part import Part

# Share of a sample that may be missing at the end of a recording, in bytes.
_MOST_OF_A_SAMPLE = 64
# Codecs of WAV files of MPEG audio.
_MPEG = (0x50, 0x55)
# RIFF files with sizes of 64 bits.
_LONG = (b"RF64", b"BW64")
_W64_TAIL = b"\xf3\xac\xd3\x11\x8c\xd1\x00\xc0\x4f\x8e\xdb\x8a"


@dataclass(frozen=True)
class Layout:
    """Layout of the chunks of a format.

    Attributes
    ----------
    magic, form : bytes
        Bytes at the start of the file, and bytes at `form_at`.
    form_at, first : int
        Place of `form` and of the first chunk.
    name, size : int
        Bytes of a chunk's name and of its size.
    order : {"little", "big"}
        Order of the bytes of a size.
    counted : int
        Bytes of a chunk's header that are included in its size.
    align : int
        Alignment of chunks in bytes.
    sound, shape : bytes
        Names of the chunk with the samples, and of the chunk that describes them.
    outer : int
        Place of the size of all chunks; 0 if the format has none.
    """

    magic: bytes
    form: bytes
    form_at: int
    first: int
    name: int
    size: int
    order: Literal["little", "big"]
    counted: int
    align: int
    sound: bytes
    shape: bytes
    outer: int = 4


def _riff(magic: bytes, order: Literal["little", "big"]) -> Layout:
    return Layout(magic, b"WAVE", 8, 12, 4, 4, order, 0, 2, b"data", b"fmt ")


_LAYOUTS = (
    _riff(b"RIFF", "little"),
    _riff(b"RF64", "little"),
    _riff(b"BW64", "little"),
    _riff(b"RIFX", "big"),
    Layout(b"FORM", b"AIFF", 8, 12, 4, 4, "big", 0, 2, b"SSND", b"COMM"),
    Layout(b"FORM", b"AIFC", 8, 12, 4, 4, "big", 0, 2, b"SSND", b"COMM"),
    Layout(
        b"riff\x2e\x91\xcf\x11\xa5\xd6\x28\xdb\x04\xc1\x00\x00",
        b"wave" + _W64_TAIL,
        *(24, 40, 16, 8),
        "little",
        *(24, 8),
        b"data" + _W64_TAIL,
        b"fmt " + _W64_TAIL,
        16,
    ),
    Layout(b"caff", b"", 8, 8, 4, 8, "big", 0, 1, b"data", b"desc", 0),
)


@dataclass(frozen=True)
class _Chunk:
    name: bytes
    size: int  # as written, of the content alone
    start: int  # place of the content
    is_padded: bool


def layout_of(content: bytes, start: int) -> Layout | None:
    """Return the layout of the file that begins at a place; None if it has no chunks."""
    for layout in _LAYOUTS:
        if content.startswith(layout.magic, start) and content.startswith(
            layout.form, start + layout.form_at
        ):
            return layout
    return None


def is_open(size: int, bits: int, present: int) -> bool:
    """Return whether a size is a placeholder of a writer that could not seek back to it.

    Parameters
    ----------
    size : int
        Size in bytes, unsigned.
    bits : int
        Bits of the size.
    present : int
        Bytes up to the end of the file.
    """
    if size == 0:
        return present > 0
    if size <= present:
        return False
    # programs write the largest number of 31 or 32 bits, rounded down to blocks or less a header
    highest = 2**bits if size >= 2 ** (bits - 1) + 2**16 else 2 ** (bits - 1)
    return abs(highest - size) <= 2**16


def read_chunks(content: bytes, start: int, layout: Layout) -> tuple[Part, int]:
    """Read the chunks of a file up to its end.

    Parameters
    ----------
    content : bytes
        Content of the file.
    start : int
        Place at which the recording begins.
    layout : Layout
        Layout of its chunks.

    Returns
    -------
    part : Part
        The recording. Its header is written anew where sizes were open or chunks misplaced.
    end : int
        Place of the recording's end.
    """
    before: list[_Chunk] = []
    end, sound = start + layout.first, None
    for chunk in _chunks(content, end, layout):
        end = chunk.start + chunk.size
        if chunk.name == layout.sound:
            sound = chunk
            break
        before.append(chunk)
    if sound is None:
        runs_out = end >= len(content) - 8
        lost = "it ends before the sound begins" if runs_out else None
        return Part(content[start:], lost=lost), len(content)
    described = {chunk.name: content[chunk.start : chunk.start + chunk.size] for chunk in before}
    present = len(content) - sound.start
    long_size = _long_size(described) if layout.magic in _LONG else None
    size, bits = (sound.size, 8 * layout.size) if long_size is None else (long_size, 64)
    shape = described.get(layout.shape, b"")
    is_mpeg = layout.form == b"WAVE" and int.from_bytes(shape[:2], layout.order) in _MPEG
    if is_open(size, bits, present) and not _is_empty(content, start, sound, layout):
        if is_mpeg:
            return read_frames(content[sound.start :], 0)[0], len(content)
        return Part(_rewritten(content, start, layout, before, sound, present)), len(content)
    if size - present >= _sample_bytes(shape, layout):
        lost = f"{present} of {size} bytes of sound are there"
        return Part(content[start:], lost=lost), len(content)
    end = _end(content, sound.start + size, start, layout)
    if is_mpeg:  # frames, which are counted
        return read_frames(content[sound.start : sound.start + size], 0)[0], end
    if all(chunk.is_padded for chunk in before):
        return Part(content[start:end], promised=_packets(described)), end
    return Part(_rewritten(content, start, layout, before, sound, min(size, present))), end


def _chunks(content: bytes, place: int, layout: Layout) -> Iterator[_Chunk]:
    """Yield the chunks from a place on; a chunk without its byte of padding is found too."""
    header = layout.name + layout.size
    while place + header <= len(content) and _is_name(content, place):
        name = content[place : place + layout.name]
        size = int.from_bytes(content[place + layout.name : place + header], layout.order)
        size = max(size - layout.counted, 0)
        after = place + header + size
        aligned = after + -(header + size) % layout.align
        is_padded = aligned == after or not _is_name(content, after)
        yield _Chunk(name, size, place + header, is_padded)
        place = aligned if is_padded else after


def _is_name(content: bytes, place: int) -> bool:
    name = content[place : place + 4]
    return len(name) == 4 and all(32 <= letter < 127 for letter in name)


def _end(content: bytes, place: int, start: int, layout: Layout) -> int:
    """Return the end of the chunks that follow a place; where another file begins, its start."""
    aligned = place + -(place - start - layout.first) % layout.align
    place = place if layout_of(content, place) else aligned
    for chunk in _chunks(content, place, layout):
        if layout_of(content, chunk.start - layout.name - layout.size):
            break
        place = chunk.start + chunk.size
        place += -chunk.size % layout.align if chunk.is_padded else 0
    return min(place, len(content))


def _is_empty(content: bytes, start: int, sound: _Chunk, layout: Layout) -> bool:
    """Return whether a file of no samples is whole: its size is that of all its chunks."""
    if sound.size or not layout.outer:
        return False
    at = start + layout.outer
    size = int.from_bytes(content[at : at + layout.size], layout.order)
    return abs(size + (0 if layout.counted else 8) - (len(content) - start)) <= 1


def _long_size(chunks: dict[bytes, bytes]) -> int | None:
    """Return the size of the sound in the chunk of 64-bit sizes of RF64."""
    sizes = chunks.get(b"ds64", b"")
    return int.from_bytes(sizes[8:16], "little") if len(sizes) >= 16 else None


def _packets(chunks: dict[bytes, bytes]) -> int | None:
    """Return the number of samples that the table of packets of a CAF file gives."""
    return int.from_bytes(chunks[b"pakt"][8:16], "big") if b"pakt" in chunks else None


def _sample_bytes(shape: bytes, layout: Layout) -> int:
    """Return the bytes of one sample of all channels, or less for codecs with blocks."""
    if layout.shape[:4] == b"fmt ":
        size = int.from_bytes(shape[12:14], layout.order)
    elif layout.shape == b"COMM":
        size = int.from_bytes(shape[:2], "big") * -(-int.from_bytes(shape[6:8], "big") // 8)
    else:
        size = int.from_bytes(shape[16:20], "big")
    return min(max(size, 1), _MOST_OF_A_SAMPLE)


def _rewritten(
    content: bytes, start: int, layout: Layout, before: list[_Chunk], sound: _Chunk, size: int
) -> bytes:
    """Write a file anew: its chunks up to the sound, aligned, and the sound of a given size."""
    parts = []
    for chunk in before:
        own = content[chunk.start : chunk.start + chunk.size]
        if chunk.name not in (b"ds64", b"JUNK"):
            parts.append(_written(chunk.name, own, layout))
    parts.append(_written(layout.sound, content[sound.start : sound.start + size], layout))
    body = b"".join(parts)
    head = bytearray(content[start : start + layout.first])
    if layout.magic in _LONG:
        head[:4] = b"RIFF"
    if layout.outer:
        total = len(body) + len(head) - (0 if layout.counted else 8)
        head[layout.outer : layout.outer + layout.size] = total.to_bytes(layout.size, layout.order)
    return bytes(head) + body


def _written(name: bytes, own: bytes, layout: Layout) -> bytes:
    size = (len(own) + layout.counted).to_bytes(layout.size, layout.order)
    return name + size + own + bytes(-(len(own)) % layout.align)
