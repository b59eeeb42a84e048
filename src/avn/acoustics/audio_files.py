"""Detection of truncated audio files, for the formats whose reader does not report it.

libsndfile silently shortens truncated WAV and AIFF files and takes the last whole page of an OGG
stream for its end, so their headers are read here.
"""

import struct

STREAMED = (0, 0xFFFFFFFF)  # sizes written by programs that cannot seek back to the header
OGG_PAGE = 27  # bytes of a page header before its segment table
OGG_END = 0x04


def missing_part(content: bytes) -> str | None:
    """Describe the missing part of a truncated audio file.

    Parameters
    ----------
    content : bytes
        Content of the file.

    Returns
    -------
    str or None
        A phrase for an error message; None if nothing is known to be missing.
    """
    if content[:4] == b"RIFF" and content[8:12] == b"WAVE":
        return _missing_chunk(content, b"data", "<I")
    if content[:4] == b"FORM" and content[8:12] in (b"AIFF", b"AIFC"):
        return _missing_chunk(content, b"SSND", ">I")
    if content[:4] == b"OggS":
        return _missing_page(content)
    return None


def _missing_chunk(content: bytes, sound: bytes, size_format: str) -> str | None:
    """Read the chunks of a RIFF or AIFF file up to the one of the samples."""
    place = 12
    while place + 8 <= len(content):
        name = content[place : place + 4]
        (size,) = struct.unpack_from(size_format, content, place + 4)
        present = len(content) - place - 8
        if name == sound:
            if size in STREAMED or size <= present:
                return None
            return f"{present} of {size} bytes of sound are there"
        place += 8 + size + size % 2
    return "it ends before the sound begins"


def _missing_page(content: bytes) -> str | None:
    """Check that the last page of an OGG stream is whole and marked as the last."""
    last = content.rfind(b"OggS")
    segments_at = last + OGG_PAGE
    if segments_at <= len(content):
        count = content[segments_at - 1]
        table = content[segments_at : segments_at + count]
        end = segments_at + count + sum(table)
        if len(table) == count and end <= len(content) and content[last + 5] & OGG_END:
            return None
    return "its stream has no end"
