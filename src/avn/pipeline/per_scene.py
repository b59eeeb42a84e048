"""What a network makes of each apartment, as a stage with one file for each of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import torch
from omegaconf import DictConfig
from torch import Tensor

from avn.core.files import stage_folder
from avn.core.hashing import digest
from avn.dataset import scene_file
from avn.dataset.scene import Scene
from avn.pipeline.stage import make_once


@dataclass(frozen=True)
class Outcome:
    """What a network makes of apartments: a stage with one file for each.

    Attributes
    ----------
    stage : str
        Its folder under `outputs`.
    what : str
        Name of the folder in it.
    kind, dataset, version : str, str, int
        Of the files.
    made_from : str
        Hash of everything that it depends on beside the apartment.
    title : str
        What it is, for the line that says that it is missing.
    seconds : float
        How long it takes on two cores, roughly.
    """

    stage: str
    what: str
    kind: str
    dataset: str
    version: int
    made_from: str
    title: str
    seconds: float

    def of(
        self,
        cfg: DictConfig,
        chosen: Sequence[Scene],
        apartments: Sequence[str],
        make: Callable[[Scene], Tensor],
    ) -> list[Tensor]:
        """What the network makes of each apartment, made where it is missing.

        Parameters
        ----------
        chosen : sequence of Scene
        apartments : sequence of str
            Hash of what it depends on of each of them.
        make : callable
            Applies the network to one.

        Raises
        ------
        UserError
            Where a file is damaged, or it is missing and `auto` is false.
        """
        folder = stage_folder(cfg.outputs, self.stage, self.what, self.made_from)
        hashes = [digest(self.made_from, own) for own in apartments]
        pairs = zip(chosen, hashes, strict=True)
        paths = [self._path(cfg, scene, own) for scene, own in pairs]

        def make_missing() -> None:
            for scene, path, own in zip(chosen, paths, hashes, strict=True):
                if not path.is_file():
                    self._write(path, own, make(scene))

        make_once(
            folder,
            f"{self.title} in {', '.join(scene.name for scene in chosen)}",
            done=lambda: all(path.is_file() for path in paths),
            make=make_missing,
            auto=cfg.auto,
            seconds=self.seconds,
        )
        return [self._read(path, own) for path, own in zip(paths, hashes, strict=True)]

    def put(self, cfg: DictConfig, scene: Scene, apartment: str, found: Tensor) -> None:
        """Keep what was found for an apartment on the way to something else, unless it is there."""
        own = digest(self.made_from, apartment)
        path = self._path(cfg, scene, own)
        if not path.is_file():
            self._write(path, own, found)

    def _path(self, cfg: DictConfig, scene: Scene, made_from: str) -> Path:
        folder = stage_folder(cfg.outputs, self.stage, self.what, self.made_from)
        return folder / f"{scene.name}-{made_from[:8]}.h5"

    def _write(self, path: Path, made_from: str, found: Tensor) -> None:
        def fill(file: h5py.File) -> None:
            file[self.dataset] = found.numpy()

        scene_file.write(path, self.kind, self.version, made_from, fill)

    def _read(self, path: Path, made_from: str) -> Tensor:
        with scene_file.open_checked(path, self.kind, self.version, made_from) as file:
            return torch.from_numpy(file[self.dataset][()])
