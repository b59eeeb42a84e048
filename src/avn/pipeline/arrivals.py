"""Stage of how the sound of every clip arrives, by a sound network with heads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor

from avn.pipeline.sound_network import HeardBySoundModel


class ArrivalEstimates(HeardBySoundModel):
    """Stage of the outputs of the heads for every clip.

    The product is (K, S, sounds, realisations, bins + 6) float16 per apartment; see
    `avn.core.heard.Arrivals`.
    """

    kind = "hear/arrivals"

    def output_of(self, model: Any) -> Callable[..., Tensor]:
        """Return the function from clips, and what is told, to the outputs of the heads."""

        def heads(clips: Tensor, *told: Tensor) -> Tensor:
            found: Tensor = model.arrival(clips, *told)
            return found.to(torch.float16)

        return heads

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return f"arrivals by '{self.cfg.sound_model.name}' in {self.where}"
