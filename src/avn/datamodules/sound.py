"""Audio clips of the training and validation apartments, as batches of spectrograms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import lightning as L
import torch
from torch import Tensor
from torch.utils.data import Dataset, Sampler

from avn.acoustics.clips import DrySounds
from avn.acoustics.microphone import Microphone
from avn.core.classes import build_part
from avn.core.errors import UserError
from avn.core.prefetch import PrefetchLoader
from avn.datamodules.clip_set import ClipSet
from avn.datamodules.second_sources import SecondSources
from avn.dataset.scene import AudibleScene, Scene
from avn.dataset.source_locations import locate_sources
from avn.modules.audio_network import PictureBatch
from avn.modules.spectrogram import Spectrogram

# Seed of the clips on which networks are validated; the same for every `train_seed`.
VALIDATION_SEED = 0


class ClipSampler(Sampler[int]):
    """Sampler of a training epoch: every pair in a random order, in a new realisation.

    The order depends on the seed and the epoch alone, so that a resumed training gets the same
    clips as an uninterrupted one.

    Parameters
    ----------
    clips : ClipSet
        Training clips.
    seed : int
        Seed of the order and of the sounds.
    sounds_per_pair : int
        Number of sounds of each pair in one epoch.
    """

    def __init__(self, clips: ClipSet, seed: int, sounds_per_pair: int) -> None:
        self.clips, self.seed, self.sounds_per_pair = clips, seed, sounds_per_pair
        self.epoch = 0

    def set_epoch(self, epoch: int) -> None:
        """Set the epoch; the trainer calls this before each epoch."""
        self.epoch = epoch

    def __len__(self) -> int:
        """Return the number of items of an epoch."""
        return self.clips.pairs * self.sounds_per_pair

    def __iter__(self) -> Iterator[int]:
        """Yield the items of the epoch."""
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        sounds = len(self.clips.sounds.names)
        ranks = torch.rand(self.clips.pairs, sounds, generator=generator).argsort(1)
        sound = ranks[:, : self.sounds_per_pair].flatten()
        pair = torch.arange(self.clips.pairs).repeat_interleave(self.sounds_per_pair)
        items = self.clips.item(pair, sound, self.epoch)
        yield from items[torch.randperm(len(items), generator=generator)].tolist()


class PictureSet(Dataset[PictureBatch]):
    """Data set of the spectrograms of clips.

    Parameters
    ----------
    clips : ClipSet
        The clips.
    spectrogram : Spectrogram
        Transform of clips to pictures.
    """

    def __init__(self, clips: ClipSet, spectrogram: Spectrogram) -> None:
        self.clips, self.spectrogram = clips, spectrogram

    def __len__(self) -> int:
        """Return the number of clips of one realisation."""
        return len(self.clips)

    def __getitem__(self, item: int) -> PictureBatch:
        """Make a batch of one item."""
        return self.__getitems__([item])

    def __getitems__(self, items: Sequence[int]) -> PictureBatch:
        """Render a batch of several items and compute its spectrograms."""
        batch = self.clips.__getitems__(items)
        return PictureBatch(
            pictures=self.spectrogram(batch["clips"]),
            target=batch["target"],
            in_sight=batch["in_sight"],
            sound=batch["sound"],
            told=batch["told"],
            mask=batch["mask"],
        )


class SoundData(L.LightningDataModule):
    """Training and validation data of an audio network.

    Parameters
    ----------
    train, validation : sequence of AudibleScene
        Apartments of the two splits.
    sounds : DrySounds
        Bank of dry sounds, used for both.
    microphone : Microphone
        Microphones at the ears.
    recipe : Any
        Settings, of which `spectrogram`, `batch`, `train_seed`, `sounds_per_pair` and
        `validation_clips` are used.

    Attributes
    ----------
    node, what : str
        Node of the settings in the config, and name of the network, for messages.

    Raises
    ------
    UserError
        If a split is empty or a number is out of range.
    """

    node: ClassVar[str] = "sound_model"
    what: ClassVar[str] = "sound network"

    def __init__(
        self,
        train: Sequence[AudibleScene],
        validation: Sequence[AudibleScene],
        sounds: DrySounds,
        microphone: Microphone,
        recipe: Any,
    ) -> None:
        super().__init__()
        if not train or not validation:
            empty = "validation" if train else "train"
            raise UserError(f"split.{empty} has no apartment; the {self.what} needs at least one")
        if not 1 <= recipe.sounds_per_pair <= len(sounds.names):
            raise UserError(
                f"{self.node}.sounds_per_pair is {recipe.sounds_per_pair}; "
                f"give 1 to {len(sounds.names)}, the number of sounds"
            )
        if recipe.batch < 1 or recipe.validation_clips < 1:
            raise UserError(f"{self.node}.batch and {self.node}.validation_clips must be 1 or more")
        self.scenes = {"validation": list(validation), "train": list(train)}
        self.sounds, self.recipe = sounds, recipe
        self.spectrogram: Spectrogram = build_part(recipe.spectrogram, self.node, rate=sounds.rate)
        # Number of threads that render, beside those of the network.
        self.threads = 1
        seed = recipe.train_seed

        def clips(scenes: Sequence[AudibleScene], purpose: str, seed: int) -> ClipSet:
            targets = [self.target_of(scene) for scene in scenes]
            return ClipSet(scenes, sounds, microphone, purpose, seed, targets)

        self.train_clips = clips(train, "train", seed)
        self.train_clips.second = self.second_sources()
        self.measured_clips = {
            split: clips(scenes, "eval", VALIDATION_SEED) for split, scenes in self.scenes.items()
        }

    def target_of(self, scene: Scene) -> Tensor:
        """Return the targets of all pairs of source and state of an apartment, (K, S, ...)."""
        return locate_sources(scene)[0]

    def second_sources(self) -> SecondSources | None:
        """Return the second sources of the training clips; None by default."""
        return None

    def train_dataloader(self) -> PrefetchLoader:
        """Build the loader of the training clips: `sounds_per_pair` for each pair and epoch."""
        return self.loader(self.train_clips, self.train_sampler())

    def train_sampler(self) -> Sampler[int]:
        """Build the sampler of the training clips."""
        return ClipSampler(self.train_clips, self.recipe.train_seed, self.recipe.sounds_per_pair)

    def val_dataloader(self) -> list[PrefetchLoader]:
        """Build the loaders of fixed clips of validation and training apartments, in this order."""
        loaders = []
        for clips in self.measured_clips.values():
            generator = torch.Generator().manual_seed(VALIDATION_SEED)
            items = torch.randperm(len(clips), generator=generator)[: self.recipe.validation_clips]
            # Sorted, so that the impulse responses are read in the order of the file.
            loaders.append(self.loader(clips, items.sort().values.tolist()))
        return loaders

    def loader(self, clips: ClipSet, sampler: Sampler[int] | list[int]) -> PrefetchLoader:
        """Build a loader of spectrograms of some clips, in the order of a sampler."""
        pictures = PictureSet(clips, self.spectrogram)
        return PrefetchLoader(pictures, self.threads, batch_size=self.recipe.batch, sampler=sampler)
