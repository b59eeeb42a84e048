"""Outputs of audio networks on the clips that agents hear, computed step by step.

A table of the outputs of every clip is worth its time where each clip is heard often. Episodes with
one of many sounds each hear a small part of all clips, so the network is applied to these alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor

from avn.pipeline.audio_inference import AudioInference
from avn.pipeline.rendered_audio import Waveforms
from avn.pipeline.scenes import DirectSound
from avn.pipeline.stage import Stage


class LiveInference(Waveforms):
    """Stage of a network's outputs for the clips that agents hear. It has no file of its own.

    Parameters
    ----------
    table : AudioInference
        Stage of the table that it stands for: network, apartments, clips.
    """

    kind = "hear/live"

    def __init__(self, table: AudioInference) -> None:
        super().__init__(table.cfg, table.apartments, table.clips)
        self._table = table

    def needs(self) -> Sequence[Stage]:
        """Return the stages of the apartments' acoustics and of the network."""
        return (DirectSound(self.cfg, self.apartments), self._table.network)

    def settings(self) -> Sequence[str]:
        """Return the keys of the table."""
        return self._table.settings()

    def content(self) -> Any:
        """Return the content of the table's fingerprint, and its kind."""
        return (*self._table.content(), self._table.kind)

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return self._table.title

    def check(self) -> None:
        """Refuse what the table refuses."""
        self._table.check()

    def output(self) -> tuple[Callable[[Tensor], Tensor], tuple[int, ...]]:
        """Return the function from clips (N, 2, rate) to outputs, and the shape of one."""
        model = self._table.network.load()
        model.eval()
        forward = self._table.output_of(model)

        @torch.inference_mode()
        def outputs(clips: Tensor) -> Tensor:
            return forward(clips.to(model.device)).cpu().float()

        return outputs, tuple(outputs(torch.zeros(1, 2, self._rate)).shape[1:])
