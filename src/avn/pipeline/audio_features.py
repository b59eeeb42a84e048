"""Audio embeddings, the sound network's last layer of every clip, as a stage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from avn.pipeline.audio_inference import AudioInference, Clips
from avn.pipeline.sound_network import SoundNetwork, SourceEstimates


class AudioEmbeddings(AudioInference):
    """What the sound network's last layer makes of every clip.

    Its product is (K, S, sounds, takes, D) float16 for each apartment; see
    `avn.modules.sound_cnn.SoundCnn.features`.
    """

    kind = "hear/embeddings"

    @property
    def network(self) -> SoundNetwork:
        """The sound network."""
        return SoundNetwork(self.cfg)

    def answer(self, model: Any) -> Callable[[Tensor], Tensor]:
        """The last layer."""
        found: Callable[[Tensor], Tensor] = model.features
        return found

    @property
    def title(self) -> str:
        """What it is."""
        name, where = self.cfg.sound_model.name, self.apartments.title
        return f"audio embeddings by '{name}' in {where} ({self.clips.purpose})"

    def by_products(self) -> Sequence[SourceEstimates]:
        """Source estimates of a network with `flip_tta`, which are the last two numbers."""
        if self.clips != Clips() or not self.cfg.sound_model.get("flip_tta"):
            return ()
        return (SourceEstimates(self.cfg, self.apartments),)

    def locks(self) -> Sequence[Path]:
        """The files that are missing, those of the by-product included."""
        others = [path for stage in self.by_products() for path in stage.locks()]
        return sorted([*super().locks(), *others])

    def opened(self) -> Callable[[int], Tensor]:
        """Open the network and the scenes, and give what listens in one of them."""
        listen, estimates = super().opened(), self.by_products()

        def embed(index: int) -> Tensor:
            found = listen(index)
            for own in estimates:
                own.keep(index, found[..., -2:].contiguous())
            return found.to(torch.float16)

        return embed
