"""Stage of audio embeddings: features of the sound network for every clip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from avn.pipeline.audio_inference import AudioInference, Clips
from avn.pipeline.sound_network import SoundNetwork, SourceEstimates


class AudioEmbeddings(AudioInference):
    """Audio embeddings of every clip by the sound network.

    The product is (K, S, sounds, realisations, D) float16 per apartment; see
    `avn.modules.sound_cnn.SoundCnn.features`.
    """

    kind = "hear/embeddings"

    @property
    def network(self) -> SoundNetwork:
        """Stage of the sound network."""
        return SoundNetwork(self.cfg)

    def output_of(self, model: Any) -> Callable[[Tensor], Tensor]:
        """Return the function from clips to embeddings."""
        features: Callable[[Tensor], Tensor] = model.features
        return features

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        name, where = self.cfg.sound_model.name, self.where
        return f"audio embeddings by '{name}' in {where} ({self.clips.purpose})"

    def by_products(self) -> Sequence[SourceEstimates]:
        """Return the stage of source estimates, the last two features with `flip_tta`."""
        if self.clips != Clips() or not self.cfg.sound_model.get("flip_tta"):
            return ()
        return (SourceEstimates(self.cfg, self.apartments),)

    def locks(self) -> Sequence[Path]:
        """Return the missing files, those of the by-product included."""
        others = [path for stage in self.by_products() for path in stage.locks()]
        return sorted([*super().locks(), *others])

    def opened(self) -> Callable[[int], Tensor]:
        """Load the network and the scenes; return the function from index to embeddings."""
        infer_in, estimates = super().opened(), self.by_products()

        def embed(index: int) -> Tensor:
            embeddings = infer_in(index)
            for stage in estimates:
                stage.keep(index, embeddings[..., -2:].contiguous())
            return embeddings.to(torch.float16)

        return embed
