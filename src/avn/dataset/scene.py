"""A scene folder: what an apartment is, how it sounds, read back from its files."""

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
from avn.dataset.views import Views, read_views

# Raised when the layout of a file changes.
GEOMETRY_VERSION = 1
TAIL_VERSION = 1
FIRST_ARRIVAL_VERSION = 1


def tail_file(folder: Path) -> Path:
    """The file of the traced reverberation, which the regimes share."""
    return folder / "acoustics-tail.h5"


def first_arrival_file(folder: Path, regime: str) -> Path:
    """The file of the first arrivals of a regime."""
    return folder / f"acoustics-{regime}.h5"


def geometry_file(folder: Path) -> Path:
    """The file of the floor plan and its grid."""
    return folder / "geometry.h5"


class Brirs:
    """Binaural room impulse responses of one apartment in one regime.

    Parameters
    ----------
    folder : Path
        The scene folder.
    regime : str
        `resonance` or `diffraction`.
    sources, cells : int
        How many there must be.
    made_from : str, optional
        The hash that the first arrivals must carry.

    Attributes
    ----------
    samples : int
        Length T of a response, at 16 kHz.
    """

    def __init__(
        self, folder: Path, regime: str, sources: int, cells: int, made_from: str | None = None
    ) -> None:
        pairs = (sources, cells)
        self._tail, self._tail_scale, marks = _read(
            tail_file(folder), "acoustics-tail", TAIL_VERSION, pairs, None, memory_map=True
        )
        path = first_arrival_file(folder, regime)
        self._first, self._first_scale, first_marks = _read(
            path, f"acoustics-{regime}", FIRST_ARRIVAL_VERSION, pairs, made_from, memory_map=False
        )
        if first_marks["tail_made_from"] != marks["made_from"]:
            raise UserError(f"{path}: belongs to another acoustics-tail.h5; make the scene again")
        self._onset = torch.from_numpy(first_marks["onset"].astype(np.int64))
        self.samples = int(self._tail.shape[-1])
        self.cut_db: NDArray[np.float32] = marks["cut_db"]

    def gather(self, source: torch.Tensor, state: torch.Tensor) -> torch.Tensor:
        """Impulse responses of N pairs.

        Parameters
        ----------
        source : (N,) int64
            Index of the source, 0..K-1.
        state : (N,) int64
            4 x cell + heading.

        Returns
        -------
        (N, 2, T) float32
            Left and right ear; the time of flight is in them.
        """
        cell, heading = state // 4, state % 4
        index = (source.numpy(), cell.numpy(), heading.numpy())
        scale = torch.from_numpy(self._tail_scale[index[:2]])
        brirs = torch.from_numpy(self._tail[index].astype(np.float32)).mul_(scale[:, None, None])
        taps = torch.from_numpy(self._first[index].astype(np.float32))
        taps *= torch.from_numpy(self._first_scale[index[:2]])[:, None, None]
        at = self._onset[source, cell][:, None] + torch.arange(taps.shape[-1])
        keep = at < self.samples
        at = at.clamp(max=self.samples - 1)[:, None].expand_as(taps)
        return brirs.scatter_add_(2, at, taps * keep[:, None])


def _read(
    path: Path,
    kind: str,
    version: int,
    pairs: tuple[int, int],
    made_from: str | None,
    memory_map: bool,
) -> tuple[NDArray[np.int16], NDArray[np.float32], dict[str, Any]]:
    with scene_file.open_checked(path, kind, version, made_from) as file:
        samples = file["samples"].shape[-1] if "samples" in file else 0
        scene_file.check_shapes(file, path, {"samples": (*pairs, 4, 2, samples), "scale": pairs})
        marks = dict(file.attrs)
        marks.update({name: file[name][()] for name in ("onset", "cut_db") if name in file})
        scale = file["scale"][()]
        dataset = file["samples"]
        if memory_map:
            # contiguous on purpose: the system reads the pages that are asked for, no more
            offset, shape = dataset.id.get_offset(), dataset.shape
            return np.memmap(path, np.int16, "r", offset, shape), scale, marks
        return dataset[()], scale, marks


@dataclass(frozen=True)
class Scene:
    """An apartment as its scene folder holds it.

    Attributes
    ----------
    folder : Path
        The scene folder.
    plan, grid : FloorPlan, Grid
        What is built, and its C cells.
    sources : (K,) int32
        Cells of the sources.
    in_sight : (K, C) bool
        Whether the straight line from the source to the ears meets no surface.
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

    def brirs(self, regime: str, made_from: str | None = None) -> Brirs:
        """The impulse responses of a regime; raises `UserError` where they are not there."""
        return Brirs(self.folder, regime, len(self.sources), self.grid.cells, made_from)

    def views(self, renderer: str, made_from: str | None = None, look: int = 0) -> Views:
        """The views by a renderer; raises `UserError` where they are not there."""
        return read_views(self.folder, renderer, 4 * self.grid.cells, made_from, look)


def load(folder: Path, made_from: str | None = None) -> Scene:
    """Open a scene folder; raises `UserError` where its geometry is missing or damaged."""
    path = geometry_file(folder)
    with scene_file.open_checked(path, "geometry", GEOMETRY_VERSION, made_from) as file:
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
    return Scene(folder, plan, grid, data["sources"], data["in_sight"].astype(bool))
