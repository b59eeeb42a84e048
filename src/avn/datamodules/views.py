"""Views of the training and validation apartments, with the occupancy of their windows."""

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
from avn.modules.settings import AugmentConfig
from avn.modules.view_augment import augment

# Seed of the views on which networks are validated; the same for every `train_seed`.
VALIDATION_SEED = 0
# Stride of the learned depth, in pixels of the view.
COARSE = 4


@dataclass(frozen=True)
class ApartmentViews:
    """Views and windows of one apartment with S states.

    Attributes
    ----------
    rgb : sequence of (S, H, W, 3) uint8 arrays
        Views, one array for each appearance.
    depth : sequence of (S, H, W) float16 arrays
        Depth along the camera's axis, metres; 0 for no surface.
    free, visible : (S, 5, 5) bool
        Free cells and visible cells of the window of each state.
    rooms : (S, 5, 5) bool
        Cells that are part of a room; see `avn.apartments.local_patch.window_rooms`.
    """

    rgb: Sequence[NDArray[np.uint8]]
    depth: Sequence[NDArray[np.float16]]
    free: NDArray[np.bool_]
    visible: NDArray[np.bool_]
    rooms: NDArray[np.bool_]


class ViewSet(Dataset[ViewBatch]):
    """Data set of the views of some apartments.

    An item is the integer `epoch x states + state`, where states are numbered through all
    apartments. `__getitems__` makes a whole batch; its random draws depend on its items and the
    seed alone.

    Parameters
    ----------
    apartments : sequence of ApartmentViews
        Views and windows.
    seed : int
        Seed of the augmentation.
    augmented : AugmentConfig, optional
        Augmentation of the views, each in an appearance that is drawn at random. None gives the
        views of the first appearance without augmentation.
    mirror : bool
        True to mirror half of the views.
    """

    def __init__(
        self,
        apartments: Sequence[ApartmentViews],
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
        self.rooms = torch.from_numpy(np.concatenate([each.rooms for each in apartments])).float()

    def __len__(self) -> int:
        """Return the number of states of all apartments."""
        return len(self.free)

    def __getitem__(self, item: int) -> ViewBatch:
        """Make a batch of one item."""
        return self.__getitems__([item])

    def __getitems__(self, items: Sequence[int]) -> ViewBatch:
        """Make a batch of several items."""
        number = torch.as_tensor(items, dtype=torch.int64)
        state = number % len(self)
        generator = torch.Generator().manual_seed(_mix(self.seed, items))
        appearance = torch.rand(len(state), generator=generator) if self.augmented else None
        rgb, depth = self._pictures(state, appearance)
        pictures = rgb.permute(0, 3, 1, 2).float() / 255
        # The nearest pixel: a mean over an edge is the depth of no surface.
        coarse = depth[:, None, COARSE // 2 :: COARSE, COARSE // 2 :: COARSE].float()
        inverse = torch.where(coarse > 0, 1 / coarse.clamp_min(0.05), 0.0)
        batch = ViewBatch(
            pictures=pictures,
            target=self.free[state],
            visible=self.visible[state],
            rooms=self.rooms[state],
            inverse_depth=inverse,
        )
        if self.mirror:
            _mirror_some(batch, torch.rand(len(state), generator=generator) < 0.5)
        if self.augmented:
            batch["pictures"] = augment(batch["pictures"], self.augmented, generator)
        return batch

    def _pictures(self, state: Tensor, appearance: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return views (N, H, W, 3) and depth (N, H, W); `appearance` (N,) is uniform in [0, 1)."""
        rgb, depth = [], []
        for row, (index, each) in enumerate(zip(self.apartment[state], state, strict=True)):
            views = self.apartments[index]
            variant = int(appearance[row] * len(views.rgb)) if appearance is not None else 0
            rgb.append(views.rgb[variant][each - self.first[index]])
            depth.append(views.depth[variant][each - self.first[index]])
        return torch.from_numpy(np.stack(rgb)), torch.from_numpy(np.stack(depth))


def _mix(seed: int, items: Sequence[int]) -> int:
    """Combine a seed and a batch's items to one seed."""
    mixed = seed + 1
    for item in (len(items), items[0], items[-1]):
        mixed = (mixed * 6364136223846793005 + item + 1442695040888963407) % 2**63
    return mixed


def _mirror_some(batch: ViewBatch, rows: Tensor) -> None:
    """Mirror the rows of a batch where `rows` (N,) is True."""
    for value in batch.values():
        assert isinstance(value, Tensor)
        value[rows] = value[rows].flip(-1)


class ViewSampler(Sampler[int]):
    """Sampler of a training epoch: every view `times` times in a random order.

    The order depends on the seed and the epoch alone. The items of each epoch, and so the
    augmentations, are new.

    Parameters
    ----------
    count : int
        Number of views.
    seed : int
        Seed of the order.
    times : int
        Number of repetitions of each view in one epoch.
    """

    def __init__(self, count: int, seed: int, times: int) -> None:
        self.count, self.seed, self.epoch = count * times, seed, 0

    def set_epoch(self, epoch: int) -> None:
        """Set the epoch; the trainer calls this before each epoch."""
        self.epoch = epoch

    def __len__(self) -> int:
        """Return the number of items of an epoch."""
        return self.count

    def __iter__(self) -> Iterator[int]:
        """Yield the items of the epoch."""
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        order = torch.randperm(self.count, generator=generator)
        yield from (self.epoch * self.count + order).tolist()


class ViewData(L.LightningDataModule):
    """Training and validation data of the occupancy network.

    Parameters
    ----------
    train, validation : sequence of ApartmentViews
        Apartments of the two splits.
    recipe : Any
        Settings, of which `batch`, `train_seed`, `times`, `validation_views`, `augment` and
        `flip_augmentation` are used.

    Raises
    ------
    UserError
        If a split is empty.
    """

    def __init__(
        self, train: Sequence[ApartmentViews], validation: Sequence[ApartmentViews], recipe: Any
    ) -> None:
        super().__init__()
        if not train or not validation:
            empty = "validation" if train else "train"
            raise UserError(
                f"split.{empty} has no apartment; the occupancy network needs at least one"
            )
        self.recipe = recipe
        # Number of threads that make batches, beside those of the network.
        self.threads = 1
        seed = recipe.train_seed
        self.train_views = ViewSet(train, seed, recipe.augment, recipe.flip_augmentation)
        self.measured_views = {"validation": ViewSet(validation), "train": ViewSet(train)}

    @property
    def prior(self) -> Tensor:
        """Frequency with which each cell of the window is free in training apartments, (5, 5)."""
        return self.train_views.free.mean(0)

    def train_dataloader(self) -> PrefetchLoader:
        """Build the loader of the training views: each `times` times in an epoch, augmented."""
        recipe = self.recipe
        sampler = ViewSampler(len(self.train_views), recipe.train_seed, recipe.times)
        return self._loader(self.train_views, sampler)

    def val_dataloader(self) -> list[PrefetchLoader]:
        """Build the loaders of fixed validation views and training views, not augmented."""
        loaders = []
        for views in self.measured_views.values():
            generator = torch.Generator().manual_seed(VALIDATION_SEED)
            items = torch.randperm(len(views), generator=generator)
            items = items[: self.recipe.validation_views].sort().values
            loaders.append(self._loader(views, items.tolist()))
        return loaders

    def _loader(self, views: ViewSet, sampler: Sampler[int] | list[int]) -> PrefetchLoader:
        return PrefetchLoader(views, self.threads, batch_size=self.recipe.batch, sampler=sampler)
