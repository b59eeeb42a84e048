"""Which clip is heard: one tensor for each thing that tells it from others."""

from __future__ import annotations

from typing import NamedTuple

from torch import Tensor


class ClipId(NamedTuple):
    """The clips of N agents or of N rows of a batch.

    Attributes
    ----------
    source, state : (N,) int64 tensor
        Where the sound comes from and where it is heard.
    sound : (N,) int64 tensor
        Which recording, as an index.
    realisation : (N,) int64 tensor
        Which draw of the recording's start and of the microphone's noise.
    """

    source: Tensor
    state: Tensor
    sound: Tensor
    realisation: Tensor
