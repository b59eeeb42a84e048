"""Views of the training and validation apartments with the windows that they show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import lightning as L
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.utils.data import Dataset, Sampler

from avn.core.errors import UserError
from avn.core.prefetch import PrefetchLoader
from avn.modules.occupancy_cnn import ViewBatch
from avn.modules.view_augment import AugmentConfig, augment

# The views on which networks in training are compared; the same for every `train_seed`.
VALIDATION_SEED = 0
# Pixels of a view for one of the depth that is learned.
COARSE = 4


@dataclass(frozen=True)
class Seen:
    """What is needed of one apartment.

    Attributes
    ----------
    rgb : sequence of (S, H, W, 3) uint8 arrays
        Its views, one array for each look.
    depth : sequence of (S, H, W) float16 arrays
        Metres along the camera's axis, 0 for nothing.
    free, visible : (S, 5, 5) bool
        The window of each state.
    """

    rgb: Sequence[NDArray[np.uint8]]
    depth: Sequence[NDArray[np.float16]]
    free: NDArray[np.bool_]
    visible: NDArray[np.bool_]


class ViewSet(Dataset[ViewBatch]):
    """The views of some apartments.

    An item is one number, `epoch x states + state`, where states count through the apartments. A
    batch is made at once by `__getitems__`, and what is random in it comes of its items and the
    seed alone.

    Parameters
    ----------
    apartments : sequence of Seen
    seed : int
    augmented : AugmentConfig, optional
        How views are changed, in a look drawn for each. Without it they are as they are, in the
        first look.
    mirror : bool
        Whether half of them are mirrored.
    """

    def __init__(
        self,
        apartments: Sequence[Seen],
        seed: int = 0,
        augmented: AugmentConfig | None = None,
        mirror: bool = False,
    ) -> None:
        self.apartments, self.seed = apartments, seed
        self.augmented, self.mirror = augmented, mirror
        sizes = torch.tensor([len(each.free) for each in apartments])
        self.first = sizes.cumsum(0) - sizes
        self.apartment = torch.arange(len(sizes)).repeat_interleave(sizes)
        self.free = torch.from_numpy(np.concatenate([each.free for each in apartments])).float()
        self.visible = torch.from_numpy(np.concatenate([each.visible for each in apartments]))

    def __len__(self) -> int:
        return len(self.free)

    def __getitem__(self, item: int) -> ViewBatch:
        return self.__getitems__([item])

    def __getitems__(self, items: Sequence[int]) -> ViewBatch:
        """Make a batch."""
        number = torch.as_tensor(items, dtype=torch.int64)
        state = number % len(self)
        generator = torch.Generator().manual_seed(_mix(self.seed, items))
        look = torch.rand(len(state), generator=generator) if self.augmented else None
        rgb, depth = self._pictures(state, look)
        pictures = rgb.permute(0, 3, 1, 2).float() / 255
        # The nearest pixel: a mean over an edge is the depth of nothing.
        coarse = depth[:, None, COARSE // 2 :: COARSE, COARSE // 2 :: COARSE].float()
        inverse = torch.where(coarse > 0, 1 / coarse.clamp_min(0.05), 0.0)
        batch = ViewBatch(
            pictures=pictures,
            target=self.free[state],
            visible=self.visible[state],
            inverse_depth=inverse,
        )
        if self.mirror:
            _mirror_some(batch, torch.rand(len(state), generator=generator) < 0.5)
        if self.augmented:
            batch["pictures"] = augment(batch["pictures"], self.augmented, generator)
        return batch

    def _pictures(self, state: Tensor, look: Tensor | None) -> tuple[Tensor, Tensor]:
        """Views (N, H, W, 3) and depth (N, H, W), each in a look drawn from 0..1."""
        rgb, depth = [], []
        for row, (index, own) in enumerate(zip(self.apartment[state], state, strict=True)):
            seen = self.apartments[index]
            which = int(look[row] * len(seen.rgb)) if look is not None else 0
            rgb.append(seen.rgb[which][own - self.first[index]])
            depth.append(seen.depth[which][own - self.first[index]])
        return torch.from_numpy(np.stack(rgb)), torch.from_numpy(np.stack(depth))


def _mix(seed: int, items: Sequence[int]) -> int:
    """One number of a seed and a batch's items."""
    mixed = seed + 1
    for item in (len(items), items[0], items[-1]):
        mixed = (mixed * 6364136223846793005 + item + 1442695040888963407) % 2**63
    return mixed


def _mirror_some(batch: ViewBatch, chosen: Tensor) -> None:
    """Exchange left and right in the chosen rows (N,) of a batch."""
    for value in batch.values():
        assert isinstance(value, Tensor)
        value[chosen] = value[chosen].flip(-1)


class ViewSampler(Sampler[int]):
    """The items of a training epoch: every view some times in a random order, each time anew.

    The order is drawn from the seed and the epoch alone.

    Parameters
    ----------
    count : int
        How many views there are.
    seed, times : int
    """

    def __init__(self, count: int, seed: int, times: int) -> None:
        self.count, self.seed, self.epoch = count * times, seed, 0

    def set_epoch(self, epoch: int) -> None:
        """Called by the trainer before each epoch."""
        self.epoch = epoch

    def __len__(self) -> int:
        return self.count

    def __iter__(self) -> Iterator[int]:
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        order = torch.randperm(self.count, generator=generator)
        yield from (self.epoch * self.count + order).tolist()


class ViewData(L.LightningDataModule):
    """What the occupancy network is trained and validated on; test apartments never enter.

    Parameters
    ----------
    train, validation : sequence of Seen
        Apartments of the two splits.
    recipe : Any
        Its `batch`, `train_seed`, `times`, `validation_views`, `augment` and `mirror` are used.

    Raises
    ------
    UserError
        Where a split is empty.
    """

    def __init__(self, train: Sequence[Seen], validation: Sequence[Seen], recipe: Any) -> None:
        super().__init__()
        if not train or not validation:
            empty = "validation" if train else "train"
            raise UserError(
                f"split.{empty} has no apartment; the occupancy network needs at least one"
            )
        self.recipe = recipe
        # Threads that make batches; the network learns in others.
        self.threads = 1
        seed = recipe.train_seed
        self.train_views = ViewSet(train, seed, recipe.augment, recipe.flip_augmentation)
        self.measured_views = {"validation": ViewSet(validation), "training": ViewSet(train)}

    @property
    def prior(self) -> Tensor:
        """How often each cell of the window is free in the training apartments, (5, 5)."""
        return self.train_views.free.mean(0)

    def train_dataloader(self) -> PrefetchLoader:
        """Every view `times` times an epoch, changed anew each time."""
        recipe = self.recipe
        sampler = ViewSampler(len(self.train_views), recipe.train_seed, recipe.times)
        return self._loader(self.train_views, sampler)

    def val_dataloader(self) -> list[PrefetchLoader]:
        """Some views of the validation and of the training apartments, as they are."""
        loaders = []
        for views in self.measured_views.values():
            generator = torch.Generator().manual_seed(VALIDATION_SEED)
            items = torch.randperm(len(views), generator=generator)
            items = items[: self.recipe.validation_views].sort().values
            loaders.append(self._loader(views, items.tolist()))
        return loaders

    def _loader(self, views: ViewSet, sampler: Sampler[int] | list[int]) -> PrefetchLoader:
        return PrefetchLoader(views, self.threads, batch_size=self.recipe.batch, sampler=sampler)
