"""What listening networks share: clips become pictures, pictures and their mirrors an answer."""

from __future__ import annotations

from typing import Any, ClassVar, TypedDict

import torch
from torch import Tensor

from avn.modules.network import Network, build_part
from avn.modules.spectrogram import Spectrogram


class ClipBatch(TypedDict):
    """N clips and what is to be known about them.

    clips (N, 2, rate) float32; target (N, ...), what is to be heard; in_sight (N,) bool; sound
    (N,) int64.
    """

    clips: Tensor
    target: Tensor
    in_sight: Tensor
    sound: Tensor


class PictureBatch(TypedDict):
    """The same of N clips as pictures (N, channels, bands, frames) float32."""

    pictures: Tensor
    target: Tensor
    in_sight: Tensor
    sound: Tensor


class Listener(Network):
    """Spectrogram and network, and the symmetry of left and right.

    A subclass calls `build_ears` after `save_hyperparameters`. Its recipe has `spectrogram`, `net`,
    `mirror` and `symmetric`, which `avn.modules.sound_cnn.SoundCnn` describes.

    Attributes
    ----------
    mirror_signs : tuple of float
        Factor on each output of a clip when its ears are exchanged.
    """

    unit = "clips"
    mirror_signs: ClassVar[tuple[float, ...]]

    def build_ears(self) -> None:
        """Build spectrogram and network from the recipe."""
        self.check_recipe()
        self.mirror: bool = self.hparams["mirror"]
        self.symmetric: bool = self.hparams["symmetric"]
        self.spectrogram: Spectrogram = build_part(self.hparams["spectrogram"], self.node)
        channels, *size = (
            self.spectrogram.channels,
            self.spectrogram.bands,
            self.spectrogram.frames,
        )
        outputs = len(self.mirror_signs)
        built = self.build("net", channels=channels, height=size[0], width=size[1], outputs=outputs)
        self.net = built.to(memory_format=torch.channels_last)

    def forward(self, clips: Tensor) -> Tensor:
        """(N, 2, rate) float32 clips to (N, outputs)."""
        return self.estimate(self.spectrogram(clips))

    def estimate(self, pictures: Tensor) -> Tensor:
        """(N, channels, bands, frames) pictures to (N, outputs)."""
        if not self.symmetric or self.training:
            return self._net(pictures)
        both = torch.cat((pictures, self.spectrogram.mirror(pictures)))
        straight, mirrored = self._net(both).chunk(2)
        return (straight + mirrored * mirrored.new_tensor(self.mirror_signs)) / 2

    def half_mirrored(self, pictures: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
        """Mirror a random half of pictures and targets (N, outputs), where the recipe says so."""
        if not self.mirror:
            return pictures, target
        chosen = torch.rand(len(target)).lt(0.5).to(target.device)
        mirrored = self.spectrogram.mirror(pictures)
        pictures = torch.where(chosen[:, None, None, None], mirrored, pictures)
        signs = target.new_tensor(self.mirror_signs)
        return pictures, torch.where(chosen[:, None], target * signs, target)

    def _net(self, pictures: Tensor) -> Tensor:
        return self.net(pictures.contiguous(memory_format=torch.channels_last))

    def prepare(self, data: Any) -> None:
        """Take the names of the sounds, by which the metrics are told apart."""
        self.name_sounds(data.sounds.names)

    def name_sounds(self, sounds: Any) -> None:
        """Say what the sounds of the batches are called."""
        raise NotImplementedError
