"""Files of frames or pages that follow each other: MP3, MP2, AAC (ADTS) and OGG."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from avn.acoustics.audio_part import Part

# kbit/s of MPEG audio by index: layers 1, 2, 3 of MPEG-1, layer 1 and layers 2, 3 of MPEG-2.
_BITRATES = {
    (1, 1): (32, 64, 96, 128, 160, 192, 224, 256, 288, 320, 352, 384, 416, 448),
    (1, 2): (32, 48, 56, 64, 80, 96, 112, 128, 160, 192, 224, 256, 320, 384),
    (1, 3): (32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192, 224, 256, 320),
    (2, 1): (32, 48, 56, 64, 80, 96, 112, 128, 144, 160, 176, 192, 224, 256),
    (2, 2): (8, 16, 24, 32, 40, 48, 56, 64, 80, 96, 112, 128, 144, 160),
    (2, 3): (8, 16, 24, 32, 40, 48, 56, 64, 80, 96, 112, 128, 144, 160),
}
_RATES = (44100, 48000, 32000)
_AAC_SAMPLES = 1024
_MOST_JUNK = 65536  # bytes before the first frame
_PAGE = 27  # bytes of an OGG page's header before its segment table
_FIRST, _LAST = 0x02, 0x04  # flags of a page
_XING = (b"Xing", b"Info")


@dataclass(frozen=True)
class _Frame:
    start: int
    length: int
    samples: int
    kind: tuple[int, int, int]  # version, layer (0 for AAC) and index of the rate
    tag: int  # place of the Xing header in a frame of layer 3


def _frame(content: bytes, start: int) -> _Frame | None:
    """Read the header of a frame of MPEG audio or AAC; None if there is none."""
    head = content[start : start + 6]
    if len(head) < 4 or head[0] != 0xFF or head[1] & 0xE0 != 0xE0:
        return None
    version = {0: 4, 2: 2, 3: 1}.get(head[1] >> 3 & 3, 0)  # 4 for MPEG-2.5
    layer = (4 - (head[1] >> 1 & 3)) % 4
    if layer == 0:
        if head[1] & 0xF0 != 0xF0 or len(head) < 6 or head[2] >> 2 & 15 > 12:
            return None
        length = (head[3] & 3) << 11 | head[4] << 3 | head[5] >> 5
        kind = (1, 0, head[2] >> 2 & 15)
        return _Frame(start, length, _AAC_SAMPLES, kind, 0) if length > 7 else None
    bitrate, rate, padding = head[2] >> 4, head[2] >> 2 & 3, head[2] >> 1 & 1
    if not version or rate == 3 or not 1 <= bitrate <= 14:
        return None
    bits = 1000 * _BITRATES[min(version, 2), layer][bitrate - 1]
    hertz = _RATES[rate] // version
    samples = {1: 384, 2: 1152, 3: 1152 if version == 1 else 576}[layer]
    slot = 4 if layer == 1 else 1
    length = (samples // 8 * bits // hertz // slot + padding) * slot
    is_mono = head[3] >> 6 == 3
    side = (17 if is_mono else 32) if version == 1 else (9 if is_mono else 17)
    return _Frame(start, length, samples, (version, layer, rate), start + 4 + side)


def is_frame(content: bytes, start: int) -> bool:
    """Return whether two frames follow each other at a place."""
    one = _frame(content, start)
    other = _frame(content, start + one.length) if one else None
    return bool(one and other and other.kind == one.kind)


def read_frames(content: bytes, start: int) -> tuple[Part, int]:
    """Count the frames of an MP3, MP2 or AAC file, and correct or add the count in its header.

    Parameters
    ----------
    content : bytes
        Content of the file.
    start : int
        Place at which the recording begins.

    Returns
    -------
    part : Part
        The recording; the content as it is if it has no such frames.
    end : int
        Place of the recording's end: that of the content, or where another recording begins.
    """
    first = _first(content, start)
    if first is None:
        return Part(content[start:]), len(content)
    frames, end = _walk(content, first)
    counted = _count_at(content, frames[0])
    held = frames[1:] if counted else frames
    present = sum(frame.samples for frame in held)
    last = frames[-1]
    promised = None
    if counted and (count := int.from_bytes(content[counted : counted + 4], "big")):
        promised = count * first.samples
    lost = None
    if last.start + last.length > len(content):
        present -= last.samples
        rest = f" of {promised}" if promised else ""
        lost = f"{present}{rest} samples and a part of a frame are there"
    elif promised and present < promised - first.samples:
        lost = f"{present} of {promised} samples are there"
    stream = content[first.start : end]
    if first.kind[1] == 3:
        stream = _with_count(content, stream, first, held, counted)
    return Part(stream, lost=lost, promised=promised, present=present), end


def _first(content: bytes, start: int) -> _Frame | None:
    """Return the first frame that is followed by another of its kind, or by the end."""
    frame = _frame(content, start)
    if frame and (is_frame(content, start) or start + frame.length == len(content)):
        return frame
    return _next(content, start, min(len(content), start + _MOST_JUNK))


def _next(content: bytes, place: int, end: int) -> _Frame | None:
    """Return the first of two frames that follow each other behind a place."""
    while (place := content.find(b"\xff", place + 1, end)) >= 0:
        if is_frame(content, place):
            return _frame(content, place)
    return None


def _walk(content: bytes, first: _Frame) -> tuple[list[_Frame], int]:
    """Return the frames from the first one on, and the place at which another recording begins."""
    frames = [first]
    place = first.start + first.length
    while place < len(content):
        frame = _frame(content, place)
        if frame is None or frame.kind != first.kind:
            tag = content[place : place + 3]
            if tag == b"TAG":  # ID3v1
                place += 128
                continue
            frame = None if tag == b"ID3" else _next(content, place, len(content))
            if frame is None or frame.kind != first.kind:
                return frames, place
        if _count_at(content, frame):
            return frames, frame.start
        frames.append(frame)
        place = frame.start + frame.length
    return frames, len(content)


def _count_at(content: bytes, frame: _Frame) -> int:
    """Return the place of the number of frames in a Xing or VBRI header; 0 if there is none."""
    if frame.kind[1] != 3:
        return 0
    if content[frame.tag : frame.tag + 4] in _XING:
        return frame.tag + 8 if content[frame.tag + 7] & 1 else 0
    vbri = frame.start + 36
    return vbri + 14 if content[vbri : vbri + 4] == b"VBRI" else 0


def _with_count(
    content: bytes, stream: bytes, first: _Frame, held: list[_Frame], counted: int
) -> bytes:
    """Give the number of frames in the header of an MP3 stream; add the header if it has none."""
    count = len(held).to_bytes(4, "big")
    if counted:
        at = counted - first.start
        known = int.from_bytes(content[counted : counted + 4], "big")
        if abs(known - len(held)) <= 1:
            return stream
        # bytes of the stream, which follow the count in a Xing header
        has_bytes = stream[at - 8 : at - 4] in _XING and stream[at - 1] & 2
        count += len(stream).to_bytes(4, "big") if has_bytes else b""
        return stream[:at] + count + stream[at + len(count) :]
    head = bytearray(content[first.start : first.start + 4])
    head[1] |= 1  # no checksum
    # the bitrate of the header must leave room for the count
    head[2] = 0x80 | head[2] & 0x0D
    frame = _frame(bytes(head) + bytes(2), 0)
    assert frame is not None
    xing = bytes(head) + bytes(frame.tag - 4) + b"Xing\0\0\0\1" + count
    return xing.ljust(frame.length, b"\0") + stream


def read_pages(content: bytes, start: int) -> tuple[Part, int]:
    """Read the pages of an OGG stream up to its last one.

    Parameters
    ----------
    content : bytes
        Content of the file.
    start : int
        Place at which the recording begins.

    Returns
    -------
    part : Part
        The recording; streams that begin together are one recording.
    end : int
        Place of the recording's end.
    """
    place, flags = start, 0
    numbers: dict[int, int] = {}
    has_gap = is_cut = False
    while content[place : place + 4] == b"OggS":
        segments = content[place + _PAGE - 1] if place + _PAGE <= len(content) else 0
        table = content[place + _PAGE : place + _PAGE + segments]
        end = place + _PAGE + segments + sum(table)
        if end > len(content):
            is_cut = True
            break
        if content[place + 5] & _FIRST and not flags & _FIRST and place > start:
            break  # another recording
        flags = content[place + 5]
        serial, number = struct.unpack_from("<II", content, place + 14)
        has_gap |= number != numbers.get(serial, number - 1) + 1
        numbers[serial] = number
        place = end
    lost = None
    if is_cut or not flags & _LAST:
        lost = f"its stream has no end, {place - start} bytes of whole pages are there"
    elif has_gap:
        lost = "pages in the middle of its stream are missing"
    return Part(content[start:place], lost=lost), len(content) if is_cut else place
