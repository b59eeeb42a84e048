"""Identity of audio clips, as one tensor for each component."""

from __future__ import annotations

from typing import NamedTuple

from torch import Tensor


class ClipId(NamedTuple):
    """Identity of the clips of N agents or of N rows of a batch.

    Attributes
    ----------
    source, state : (N,) int64 tensor
        Index of the source and state of the receiver.
    sound : (N,) int64 tensor
        Index of the recording.
    realisation : (N,) int64 tensor
        Index of the draw of the recording's start and of the microphone's noise.
    """

    source: Tensor
    state: Tensor
    sound: Tensor
    realisation: Tensor
