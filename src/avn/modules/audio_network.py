"""Base class of networks on clips: spectrograms, and the mean over a clip and its mirror image."""

from __future__ import annotations

from typing import Any, ClassVar, TypedDict

import torch
from torch import Tensor

from avn.core.classes import build_part
from avn.modules.network import Network, OptimizerConfig, Part, as_part
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


SPECTROGRAM: Part = {"_target_": "avn.modules.spectrogram.Spectrogram"}
FIVE_LAYERS: Part = {"_target_": "avn.modules.five_layer_cnn.FiveLayerCnn"}


class AudioNetwork(Network):
    """Network on spectrograms of two ears, with the symmetry of left and right.

    Parameters
    ----------
    name : str
        The option of the config group.
    spectrogram : dict
        Config of the spectrogram, with `_target_`.
    net : dict
        Config of the network behind it, with `_target_`.
    optimizer : dict
        Config of the optimiser, with `_target_`.
    schedule : {"cosine", "constant"}
        Learning rate over the epochs; "cosine" warms up over the first tenth and falls to 0.
    epochs : int
        Length of the training.
    patience : int
        Epochs without progress after which training stops early.
    batch : int
        Clips in a batch; read by the data module.
    flip_augmentation : bool
        Shows half of the training clips with ears and locations mirrored, which is exact: the
        head is symmetric and so is the world.
    flip_tta : bool
        Estimates as the mean over a clip and its mirror image, mirrored back.
    train_seed : int
        Draws the weights and all that is random in training.
    sounds_per_pair : int
        Sounds in which each pair of source and state is heard in an epoch; read by the data module.
    validation_clips : int
        Most clips of each set of apartments on which it is measured; read by the data module.
    rate : int
        Sampling rate of the clips in Hz.

    Attributes
    ----------
    mirror_signs : tuple of float
        Factor on each output of a clip when its ears are exchanged.
    """

    unit = "clips"
    mirror_signs: ClassVar[tuple[float, ...]]

    def __init__(
        self,
        name: str,
        spectrogram: Part = SPECTROGRAM,
        net: Part = FIVE_LAYERS,
        optimizer: OptimizerConfig | Part | None = None,
        schedule: str = "cosine",
        epochs: int = 15,
        patience: int = 6,
        batch: int = 64,
        flip_augmentation: bool = True,
        flip_tta: bool = True,
        train_seed: int = 0,
        sounds_per_pair: int = 1,
        validation_clips: int = 2000,
        rate: int = 16000,
    ) -> None:
        super().__init__()
        optimizer = as_part(optimizer or OptimizerConfig())
        self.save_hyperparameters(ignore=["criterion", "threshold"])
        self.check_recipe()
        self.flip_augmentation, self.flip_tta = flip_augmentation, flip_tta
        self.spectrogram: Spectrogram = build_part(spectrogram, self.node, rate=rate)
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
        if not self.flip_tta or self.training:
            return self._net(pictures)
        both = torch.cat((pictures, self.spectrogram.mirror(pictures)))
        straight, mirrored = self._net(both).chunk(2)
        return (straight + mirrored * mirrored.new_tensor(self.mirror_signs)) / 2

    def random_flip(self, pictures: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
        """Mirror a random half of pictures and targets (N, outputs), where the recipe says so."""
        if not self.flip_augmentation:
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
