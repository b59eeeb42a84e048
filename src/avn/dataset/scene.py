"""Scenes: the geometry of an apartment and its impulse responses, read from files."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan, from_dict
from avn.apartments.grid import Grid
from avn.core.errors import UserError
from avn.dataset import scene_file

# Raised when the layout of a file changes.
GEOMETRY_VERSION = 1
REVERBERATION_VERSION = 1
DIRECT_PATH_VERSION = 1


class Brirs:
    """Binaural room impulse responses of one apartment in one regime.

    Parameters
    ----------
    reverberation, direct_path : (Path, str)
        The files of the reverberation and of the direct paths, and their expected fingerprints.
    sources, cells : int
        Expected numbers of sources and of cells.

    Attributes
    ----------
    samples : int
        Length T of a response, in samples.
    cut_db : (K, C) float32
        Energy of the reverberation after T samples, in dB of all of it.

    Raises
    ------
    UserError
        If a file is missing or damaged, or its fingerprint or shape is another.
    """

    def __init__(
        self,
        reverberation: tuple[Path, str],
        direct_path: tuple[Path, str],
        sources: int,
        cells: int,
    ) -> None:
        pairs = (sources, cells)
        self._reverberation, self._reverberation_scale, marks = _read(
            reverberation, "acoustics-tail", REVERBERATION_VERSION, pairs, memory_map=True
        )
        self._direct_path, self._direct_path_scale, direct_path_marks = _read(
            direct_path, "acoustics-first", DIRECT_PATH_VERSION, pairs, memory_map=False
        )
        self._onset = torch.from_numpy(direct_path_marks["onset"].astype(np.int64))
        self.samples = int(self._reverberation.shape[-1])
        self.cut_db: NDArray[np.float32] = marks["cut_db"]

    def gather(self, source: torch.Tensor, state: torch.Tensor) -> torch.Tensor:
        """Gather the impulse responses of N pairs of source and state.

        Parameters
        ----------
        source : (N,) int64
            Index of the source, 0..K-1.
        state : (N,) int64
            4 x cell + heading.

        Returns
        -------
        (N, 2, T) float32
            Left and right ear; with the time of flight.
        """
        cell, heading = state // 4, state % 4
        index = (source.numpy(), cell.numpy(), heading.numpy())
        scale = torch.from_numpy(self._reverberation_scale[index[:2]])
        brirs = torch.from_numpy(self._reverberation[index].astype(np.float32)).mul_(
            scale[:, None, None]
        )
        taps = torch.from_numpy(self._direct_path[index].astype(np.float32))
        taps *= torch.from_numpy(self._direct_path_scale[index[:2]])[:, None, None]
        at = self._onset[source, cell][:, None] + torch.arange(taps.shape[-1])
        keep = at < self.samples
        at = at.clamp(max=self.samples - 1)[:, None].expand_as(taps)
        return brirs.scatter_add_(2, at, taps * keep[:, None])

    def energies(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Compute the energies of the direct sound and of the reverberation, (K, C) each.

        They are summed over headings, ears and samples. The two parts are stored separately, so
        no window has to divide a response; ten times the decimal logarithm of their ratio is the
        direct-to-reverberant ratio. The energy of the direct sound is 0 where there is none.
        """
        return (
            _energies(self._direct_path, self._direct_path_scale),
            _energies(self._reverberation, self._reverberation_scale),
        )


def _energies(samples: NDArray[np.int16], scale: NDArray[np.float32]) -> NDArray[np.float64]:
    squares = [
        (own.astype(np.float32) ** 2).sum(axis=(1, 2, 3), dtype=np.float64) for own in samples
    ]
    return np.stack(squares) * scale.astype(np.float64) ** 2


def _read(
    from_file: tuple[Path, str], kind: str, version: int, pairs: tuple[int, int], memory_map: bool
) -> tuple[NDArray[np.int16], NDArray[np.float32], dict[str, Any]]:
    path, fingerprint = from_file
    with scene_file.open_checked(path, kind, version, fingerprint) as file:
        samples = file["samples"].shape[-1] if "samples" in file else 0
        scene_file.check_shapes(file, path, {"samples": (*pairs, 4, 2, samples), "scale": pairs})
        marks = {name: file[name][()] for name in ("onset", "cut_db") if name in file}
        scale = file["scale"][()]
        dataset = file["samples"]
        if memory_map:
            # contiguous, so that only the pages that are used are read
            offset, shape = dataset.id.get_offset(), dataset.shape
            return np.memmap(path, np.int16, "r", offset, shape), scale, marks
        return dataset[()], scale, marks


@dataclass(frozen=True)
class Scene:
    """The geometry of an apartment.

    Attributes
    ----------
    folder : Path
        The scene folder, which also holds impulse responses and views.
    plan, grid : FloorPlan, Grid
        The floor plan, and its C cells.
    sources : (K,) int32
        Cells of the sources.
    in_sight : (K, C) bool
        True where no surface crosses the straight line from the source to the receiver.
    """

    folder: Path
    plan: FloorPlan
    grid: Grid
    sources: NDArray[np.int32]
    in_sight: NDArray[np.bool_]

    @property
    def name(self) -> str:
        """Name of the apartment."""
        return self.plan.name

    def with_brirs(self, brirs: Brirs) -> AudibleScene:
        """Return the same apartment with its impulse responses."""
        return AudibleScene(**vars(self), brirs=brirs)


@dataclass(frozen=True)
class AudibleScene(Scene):
    """An apartment with its binaural room impulse responses in one regime."""

    brirs: Brirs


def load_scene(path: Path, fingerprint: str | None = None) -> Scene:
    """Read the geometry of an apartment.

    Parameters
    ----------
    path : Path
        The file `geometry-*.h5`.
    fingerprint : str, optional
        Expected fingerprint; None accepts any.

    Raises
    ------
    UserError
        If the file is missing or damaged, or its fingerprint is another.
    """
    with scene_file.open_checked(path, "geometry", GEOMETRY_VERSION, fingerprint) as file:
        data = {name: file[name][()] for name in file}
    try:
        plan = from_dict(json.loads(data["floor_plan"]), str(path))
        cells, sources = len(data["lattice"]), len(data["sources"])
        grid = Grid(
            lattice=data["lattice"],
            neighbours=data["neighbours"],
            distances=data["distances"],
            rooms=data["rooms"],
            squares=int(data["squares"]),
        )
        wanted = {"neighbours": (cells, 4), "distances": (cells, cells), "rooms": (cells,)}
        for name, shape in {**wanted, "in_sight": (sources, cells)}.items():
            if data[name].shape != shape:
                raise UserError(f"{path}: '{name}' is {data[name].shape}, not {shape}; make again")
    except (KeyError, ValueError) as error:
        raise UserError(f"{path}: incomplete ({error}); make the scene again") from error
    return Scene(path.parent, plan, grid, data["sources"], data["in_sight"].astype(bool))
