"""Temporary files that several workers make for the files of a product."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


class Parts:
    """Parts of several files that do not exist yet, so that each file is written when it is whole.

    Parameters
    ----------
    parts : sequence of sequence of Path
        Temporary files of each file, without any in common.

    Attributes
    ----------
    whole : list of int
        Indices of the files whose parts all exist from the start.
    """

    def __init__(self, parts: Sequence[Sequence[Path]]) -> None:
        self._owner = {part: index for index, own in enumerate(parts) for part in own}
        self._left = [{part for part in own if not part.is_file()} for own in parts]
        self.whole = [index for index, left in enumerate(self._left) if not left]

    def finish(self, part: Path) -> tuple[int, bool]:
        """Note that a part exists; return the index of its file, and whether it is whole now."""
        index = self._owner[part]
        self._left[index].discard(part)
        return index, not self._left[index]
