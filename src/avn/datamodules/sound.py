"""Clips of the training and validation apartments, rendered batch by batch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import lightning as L
import torch
from torch import Tensor
from torch.utils.data import Dataset, Sampler

from avn.acoustics.clips import ClipRenderer, DrySounds, brir_spectra
from avn.acoustics.microphone import Microphone
from avn.core.classes import build_part
from avn.core.clip_id import ClipId
from avn.core.errors import UserError
from avn.core.prefetch import PrefetchLoader
from avn.dataset.scene import AudibleScene, Brirs, Scene
from avn.dataset.source_locations import where_sources_are
from avn.modules.audio_network import ClipBatch, PictureBatch
from avn.modules.spectrogram import Spectrogram

# The clips on which networks in training are compared; the same for every `train_seed`.
VALIDATION_SEED = 0


@dataclass
class SceneClips:
    """What is needed of one apartment to render clips and to judge what is heard.

    Attributes
    ----------
    brirs : Brirs
        Impulse responses.
    locations : (K, S, 2) float32 tensor
        Metres right and front.
    in_sight : (K, S) bool tensor
    """

    brirs: Brirs
    locations: Tensor
    in_sight: Tensor

    @classmethod
    def of(cls, scene: AudibleScene) -> SceneClips:
        """Of an apartment."""
        return cls(scene.brirs, *where_sources_are(scene))


class ClipSet(Dataset[ClipBatch]):
    """The clips of some apartments, each a (take, apartment, source, state, sound).

    An item is one number, `(take x pairs + pair) x sounds + sound`, so that takes never end. A
    batch is rendered at once by `__getitems__`; a clip is a pure function of its item, of
    `purpose` and of `seed`.

    Parameters
    ----------
    scenes : sequence of AudibleScene
    sounds : DrySounds
    microphone : Microphone
    purpose : {"train", "eval"}
        Takes of the two purposes have nothing in common.
    seed : int
    targets : sequence of (K, S, ...) tensors, optional
        What is to be heard in each apartment; the locations of the sources, if not given.
    """

    def __init__(
        self,
        scenes: Sequence[AudibleScene],
        sounds: DrySounds,
        microphone: Microphone,
        purpose: str,
        seed: int,
        targets: Sequence[Tensor] | None = None,
    ) -> None:
        self.scenes = [SceneClips.of(scene) for scene in scenes]
        self.sounds = sounds
        self.renderer = ClipRenderer(sounds, microphone, seed, purpose)
        shapes = [clips.in_sight.shape for clips in self.scenes]
        grids = [torch.cartesian_prod(torch.arange(k), torch.arange(s)) for k, s in shapes]
        self.source, self.state = torch.cat(grids).unbind(1)
        sizes = torch.tensor([len(grid) for grid in grids])
        self.apartment = torch.arange(len(grids)).repeat_interleave(sizes)
        wanted = targets or [clips.locations for clips in self.scenes]
        self.target = torch.cat([target.flatten(0, 1) for target in wanted])
        self.in_sight = torch.cat([clips.in_sight.flatten() for clips in self.scenes])

    @property
    def pairs(self) -> int:
        """How many pairs of source and state there are."""
        return len(self.source)

    def __len__(self) -> int:
        return self.pairs * len(self.sounds.names)

    def item(self, pair: Tensor, sound: Tensor, realisation: int) -> Tensor:
        """The number of a clip."""
        return (realisation * self.pairs + pair) * len(self.sounds.names) + sound

    def __getitem__(self, item: int) -> ClipBatch:
        return self.__getitems__([item])

    def __getitems__(self, items: Sequence[int]) -> ClipBatch:
        """Render a batch."""
        number = torch.as_tensor(items, dtype=torch.int64)
        sound = number % len(self.sounds.names)
        pair = number // len(self.sounds.names)
        realisation, pair = pair // self.pairs, pair % self.pairs
        # A pair that is heard with several sounds is transformed once.
        pair, index = pair.unique(return_inverse=True)
        spectra = brir_spectra(self._brirs(pair), self.sounds.rate)
        source, state = self.source[pair][index], self.state[pair][index]
        return ClipBatch(
            clips=self.renderer.render(spectra, ClipId(source, state, sound, realisation), index),
            target=self.target[pair][index],
            in_sight=self.in_sight[pair][index],
            sound=sound,
        )

    def _brirs(self, pair: Tensor) -> Tensor:
        """(N) pairs to (N, 2, T) impulse responses, each gathered from its apartment."""
        apartment = self.apartment[pair]
        longest = max(clips.brirs.samples for clips in self.scenes)
        brirs = torch.zeros(len(pair), 2, longest)
        for index, clips in enumerate(self.scenes):
            rows = (apartment == index).nonzero()[:, 0]
            if len(rows):
                chosen = pair[rows]
                gathered = clips.brirs.gather(self.source[chosen], self.state[chosen])
                brirs[rows, :, : clips.brirs.samples] = gathered
        return brirs


class ClipSampler(Sampler[int]):
    """The items of a training epoch in a random order: every pair, each time in another take.

    The order is drawn from the seed and the epoch alone, so that a resumed training sees what
    an uninterrupted one would have seen.

    Parameters
    ----------
    clips : ClipSet
    seed : int
    sounds_per_pair : int
        How many of the sounds a pair is heard with in one epoch.
    """

    def __init__(self, clips: ClipSet, seed: int, sounds_per_pair: int) -> None:
        self.clips, self.seed, self.sounds_per_pair = clips, seed, sounds_per_pair
        self.epoch = 0

    def set_epoch(self, epoch: int) -> None:
        """Called by the trainer before each epoch."""
        self.epoch = epoch

    def __len__(self) -> int:
        return self.clips.pairs * self.sounds_per_pair

    def __iter__(self) -> Iterator[int]:
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        sounds = len(self.clips.sounds.names)
        ranks = torch.rand(self.clips.pairs, sounds, generator=generator).argsort(1)
        chosen = ranks[:, : self.sounds_per_pair].flatten()
        pairs = torch.arange(self.clips.pairs).repeat_interleave(self.sounds_per_pair)
        items = self.clips.item(pairs, chosen, self.epoch)
        yield from items[torch.randperm(len(items), generator=generator)].tolist()


class PictureSet(Dataset[PictureBatch]):
    """Clips as the pictures that the network sees, made where the clips are made.

    Parameters
    ----------
    clips : ClipSet
    spectrogram : Spectrogram
    """

    def __init__(self, clips: ClipSet, spectrogram: Spectrogram) -> None:
        self.clips, self.spectrogram = clips, spectrogram

    def __len__(self) -> int:
        return len(self.clips)

    def __getitem__(self, item: int) -> PictureBatch:
        return self.__getitems__([item])

    def __getitems__(self, items: Sequence[int]) -> PictureBatch:
        """Render a batch and take its spectrograms."""
        batch = self.clips.__getitems__(items)
        return PictureBatch(
            pictures=self.spectrogram(batch["clips"]),
            target=batch["target"],
            in_sight=batch["in_sight"],
            sound=batch["sound"],
        )


class SoundData(L.LightningDataModule):
    """What a listening network is trained and validated on; test apartments never enter.

    Parameters
    ----------
    train, validation : sequence of AudibleScene
        Apartments of the two splits.
    sounds : DrySounds
        Training hears all of them.
    microphone : Microphone
    recipe : Any
        Its `batch`, `train_seed`, `sounds_per_pair` and `validation_clips` are used.

    Attributes
    ----------
    node, what : str
        The node of the config that the recipe is, and what it trains, for messages.

    Raises
    ------
    UserError
        Where a split is empty or a number cannot work.
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
        self.scenes = {"validation": list(validation), "training": list(train)}
        self.sounds, self.recipe = sounds, recipe
        self.spectrogram: Spectrogram = build_part(recipe.spectrogram, self.node, rate=sounds.rate)
        # Threads that render; the network learns in others.
        self.threads = 1
        seed = recipe.train_seed

        def clips(scenes: Sequence[AudibleScene], purpose: str, seed: int) -> ClipSet:
            targets = [self.target_of(scene) for scene in scenes]
            return ClipSet(scenes, sounds, microphone, purpose, seed, targets)

        self.train_clips = clips(train, "train", seed)
        self.measured_clips = {
            split: clips(scenes, "eval", VALIDATION_SEED) for split, scenes in self.scenes.items()
        }

    def target_of(self, scene: Scene) -> Tensor:
        """What is to be heard of each source in each state of an apartment, (K, S, ...)."""
        return where_sources_are(scene)[0]

    def train_dataloader(self) -> PrefetchLoader:
        """Every pair once an epoch (`sounds_per_pair` times), each time in a fresh take."""
        return self.loader(self.train_clips, self.train_sampler())

    def train_sampler(self) -> Sampler[int]:
        """The order of the training clips."""
        return ClipSampler(self.train_clips, self.recipe.train_seed, self.recipe.sounds_per_pair)

    def val_dataloader(self) -> list[PrefetchLoader]:
        """Fixed clips of the validation and of the training apartments, in this order."""
        loaders = []
        for clips in self.measured_clips.values():
            generator = torch.Generator().manual_seed(VALIDATION_SEED)
            items = torch.randperm(len(clips), generator=generator)[: self.recipe.validation_clips]
            # In order, so that the impulse responses are read from one end of the file on.
            loaders.append(self.loader(clips, items.sort().values.tolist()))
        return loaders

    def loader(self, clips: ClipSet, sampler: Sampler[int] | list[int]) -> PrefetchLoader:
        """Batches of pictures of some clips, in an order."""
        pictures = PictureSet(clips, self.spectrogram)
        return PrefetchLoader(pictures, self.threads, batch_size=self.recipe.batch, sampler=sampler)
