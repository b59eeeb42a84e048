"""One recording of an audio file."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Part:
    """Recording in a file, with a header that decoders can rely on.

    Attributes
    ----------
    content : bytes
        Content of a file with this recording alone.
    lost : str, optional
        Missing part of the recording, as a phrase; None if nothing is known to be missing.
    promised : int, optional
        Samples per channel that the header promises.
    present : int, optional
        Samples per channel in the recording, as counted without decoding it.
    """

    content: bytes
    lost: str | None = None
    promised: int | None = None
    present: int | None = None
