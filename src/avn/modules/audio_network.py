"""Base class of networks on binaural clips: spectrogram, flip augmentation, flip averaging."""

from __future__ import annotations

from typing import Any, ClassVar, TypedDict

import torch
from torch import Tensor

from avn.core.classes import build_part
from avn.modules.network import Network, Part, as_part
from avn.modules.settings import OptimizerConfig
from avn.modules.spectrogram import Spectrogram


class ClipBatch(TypedDict):
    """Batch of N clips with labels.

    Attributes
    ----------
    clips : (N, 2, rate) float32 tensor
        Waveforms of the left and the right ear.
    target : (N, ...) tensor
        Label of each clip.
    in_sight : (N,) bool tensor
        Whether the source is in the line of sight.
    sound : (N,) int64 tensor
        Index of the sound.
    told : (N,) int64 tensor
        Category of the sound that the network is told, from 1; 0 for none.
    mask : (N, bands, frames) float32 tensor
        Share of the sound in the power of each band and frame, where there are second sources; else
        without bands.
    """

    clips: Tensor
    target: Tensor
    in_sight: Tensor
    sound: Tensor
    told: Tensor
    mask: Tensor


class PictureBatch(TypedDict):
    """Batch of N clips as spectrograms, with labels.

    Attributes
    ----------
    pictures : (N, channels, bands, frames) float32 tensor
        Spectrograms.
    target, in_sight, sound, told, mask
        As those of `ClipBatch`.
    """

    pictures: Tensor
    target: Tensor
    in_sight: Tensor
    sound: Tensor
    told: Tensor
    mask: Tensor


SPECTROGRAM: Part = {"_target_": "avn.modules.spectrogram.Spectrogram"}
FIVE_LAYERS: Part = {"_target_": "avn.modules.five_layer_cnn.FiveLayerCnn"}


class AudioNetwork(Network):
    """Network on spectrograms of two ears that uses left-right symmetry.

    Parameters
    ----------
    name : str
        Name of the option.
    spectrogram : dict
        Config of the spectrogram, with `_target_`.
    net : dict
        Config of the network on the spectrogram, with `_target_`.
    optimizer : dict
        Config of the optimiser, with `_target_`.
    schedule : {"cosine", "constant"}
        Learning-rate schedule; "cosine" warms up over the first tenth of the steps and falls to 0.
    epochs : int
        Maximum number of epochs, 1 or more.
    patience : int
        Early stopping: epochs without a better monitored metric before training stops, 1 or more.
    batch : int
        Clips in a batch, 1 or more; read by the data module.
    flip_augmentation : bool
        Whether each training clip is mirrored with probability 0.5: ears and target. This is exact
        where the head is symmetric, as those of the package are.
    flip_tta : bool
        Test-time augmentation: whether an estimate is the mean over a clip and its mirror image.
    train_seed : int
        Seed of the initial weights and of all randomness in training.
    sounds_per_pair : int
        Sounds with which an epoch has each pair of source and state, 1 to the number of sounds;
        read by the data module.
    validation_clips : int
        Maximum number of clips of each subset on which metrics are computed, 1 or more; read by
        the data module.
    rate : int
        Sampling rate of the clips in hertz.

    Attributes
    ----------
    mirror_signs : tuple of float
        Factor on each output when the ears of a clip are exchanged.
    """

    unit = "clips"
    mirror_signs: ClassVar[tuple[float, ...]]
    # Channels of the network's input besides those of the spectrogram.
    further_channels = 0

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
        shape = {
            "channels": self.spectrogram.channels + self.further_channels,
            "height": self.spectrogram.bands,
            "width": self.spectrogram.frames,
        }
        built = self.build("net", **shape, outputs=self.outputs)
        self.net = built.to(memory_format=torch.channels_last)

    @property
    def outputs(self) -> int:
        """Number of outputs of the last layer."""
        return len(self.mirror_signs)

    def mirror_outputs(self, outputs: Tensor) -> Tensor:
        """Return the outputs (N, outputs) for clips with the ears exchanged."""
        return outputs * outputs.new_tensor(self.mirror_signs)

    def mirror_targets(self, target: Tensor) -> Tensor:
        """Return the targets of clips with the ears exchanged; as outputs by default."""
        return self.mirror_outputs(target)

    def forward(self, clips: Tensor) -> Tensor:
        """Map clips (N, 2, rate) float32 to outputs (N, outputs) float32."""
        return self.estimate(self.pictures(clips))

    def pictures(self, clips: Tensor) -> Tensor:
        """Return the network's input for clips (N, 2, rate): their spectrograms."""
        found: Tensor = self.spectrogram(clips)
        return found

    def estimate(self, pictures: Tensor) -> Tensor:
        """Map spectrograms (N, channels, bands, frames) to outputs (N, outputs) float32."""
        if not self.flip_tta or self.training:
            return self._net(pictures)
        both = torch.cat((pictures, self.spectrogram.mirror(pictures)))
        straight, mirrored = self._net(both).chunk(2)
        return (straight + self.mirror_outputs(mirrored)) / 2

    def random_flip(self, pictures: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
        """Mirror spectrograms and targets (N, ...) with probability 0.5 each.

        Without `flip_augmentation` nothing is mirrored.
        """
        if not self.flip_augmentation:
            return pictures, target
        flipped = torch.rand(len(target)).lt(0.5).to(target.device)
        mirrored = self.spectrogram.mirror(pictures)
        pictures = torch.where(flipped[:, None, None, None], mirrored, pictures)
        return pictures, torch.where(flipped[:, None], self.mirror_targets(target), target)

    def _net(self, pictures: Tensor) -> Tensor:
        return self.net(pictures.contiguous(memory_format=torch.channels_last))

    def prepare(self, data: Any) -> None:
        """Set the names of the sounds from the data module; metrics are grouped by them."""
        self.name_sounds(data.sounds.names)

    def name_sounds(self, sounds: Any) -> None:
        """Set the names of the sounds, by index."""
        raise NotImplementedError
