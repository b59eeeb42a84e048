"""What a network makes of apartments, as a stage with a tensor for each of them."""

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
    """A tensor for each apartment, in `outputs/<kind>/<apartment>-<hash8>.h5`."""

    @abstractmethod
    def opened(self) -> Callable[[int], Tensor]:
        """Open what is needed once, and give what makes the tensor of an apartment by number."""

    @property
    def folder(self) -> Path:
        """Where the files lie."""
        return Path(self.cfg.outputs) / self.kind

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """The file of an apartment."""
        return self.folder / f"{plan.name}-{fingerprint[:8]}.h5"

    def make(self) -> None:
        """Make the tensors that are missing."""
        tensor_of = self.opened()
        for index in self.missing():
            self.keep(index, tensor_of(index))

    def keep(self, index: int, found: Tensor) -> None:
        """Write the tensor of an apartment, unless its file is there."""

        def fill(file: h5py.File) -> None:
            file[_DATASET] = found.numpy()

        path = self.paths[index]
        if not path.is_file():
            scene_file.write(path, self.kind, _FORMAT, self.fingerprints[index], fill)

    def load(self) -> list[Tensor]:
        """The tensor of each apartment.

        Raises
        ------
        UserError
            Where a file is missing or damaged.
        """
        return [self._read(*file) for file in zip(self.paths, self.fingerprints, strict=True)]

    def _read(self, path: Path, fingerprint: str) -> Tensor:
        with scene_file.open_checked(path, self.kind, _FORMAT, fingerprint) as file:
            return torch.from_numpy(file[_DATASET][()])
