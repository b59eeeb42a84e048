"""Base class of stages with a tensor per apartment."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from pathlib import Path

import h5py
import torch
from torch import Tensor

from avn.apartments.floor_plan import FloorPlan
from avn.dataset import scene_file
from avn.pipeline.apartments import PerApartment

_DATASET = "values"
# Raised when the layout of the files changes.
_FORMAT = 1


class ApartmentTensors(PerApartment):
    """Stage with a tensor per apartment, in `outputs/<kind>/<apartment>-<hash8>.h5`."""

    @abstractmethod
    def opened(self) -> Callable[[int], Tensor]:
        """Load the needs once; return the function from an apartment's index to its tensor."""

    @property
    def folder(self) -> Path:
        """Folder of the files."""
        return Path(self.cfg.outputs) / self.kind

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """Return the path of an apartment's file."""
        return self.folder / f"{plan.name}-{fingerprint[:8]}.h5"

    def make(self) -> None:
        """Compute the missing tensors."""
        tensor_of = self.opened()
        for index in self.missing():
            self.keep(index, tensor_of(index))

    def keep(self, index: int, tensor: Tensor) -> None:
        """Write the tensor of an apartment, unless its file exists."""

        def fill(file: h5py.File) -> None:
            file[_DATASET] = tensor.numpy()

        path = self.paths[index]
        if not path.is_file():
            scene_file.write(path, self.kind, _FORMAT, self.fingerprints[index], fill)

    def load(self) -> list[Tensor]:
        """Return the tensor of each apartment.

        Raises
        ------
        UserError
            Where a file is missing or damaged.
        """
        return [self._read(*file) for file in zip(self.paths, self.fingerprints, strict=True)]

    def _read(self, path: Path, fingerprint: str) -> Tensor:
        with scene_file.open_checked(path, self.kind, _FORMAT, fingerprint) as file:
            return torch.from_numpy(file[_DATASET][()])
