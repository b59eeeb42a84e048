"""Writing of scene folders from floor plans: geometry and impulse responses.

The responses of each source are kept in a temporary file until all sources of an apartment are
done, so that an interrupted run can be resumed.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from avn.acoustics import brir
from avn.acoustics.direct_path import DirectPaths
from avn.acoustics.materials import NAMES
from avn.acoustics.settings import AcousticsConfig
from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import Grid, build_grid, source_cells
from avn.apartments.surfaces import build_surfaces, line_of_sight
from avn.apartments.walls import walls
from avn.core.errors import UserError
from avn.core.files import atomic_write, partial_folder
from avn.core.processes import in_processes
from avn.core.progress import progress_bar
from avn.dataset import scene_file
from avn.dataset.parts import Parts
from avn.dataset.scene import (
    DIRECT_PATH_VERSION,
    GEOMETRY_VERSION,
    REVERBERATION_VERSION,
    Scene,
)


def build_geometry(
    plan: FloorPlan, acoustics: AcousticsConfig, path: Path, fingerprint: str
) -> None:
    """Write the geometry of an apartment.

    Parameters
    ----------
    plan : FloorPlan
        The apartment.
    acoustics : AcousticsConfig
        Settings, of which the heights of receivers and sources are used.
    path : Path
        The file.
    fingerprint : str
        Hash of all that the file depends on; it is stored in it.

    Raises
    ------
    UserError
        If `check_plan` rejects the plan.
    """
    grid, sources = check_plan(plan)
    surfaces = build_surfaces(plan)
    receivers = _points(grid.centres, acoustics.receiver_height)
    source_positions = _points(grid.centres[sources], acoustics.source_height)
    pairs = (len(sources), grid.cells, 3)
    in_sight = line_of_sight(
        surfaces,
        np.broadcast_to(source_positions[:, None], pairs).reshape(-1, 3),
        np.broadcast_to(receivers[None], pairs).reshape(-1, 3),
    ).reshape(pairs[:2])

    def fill(file: h5py.File) -> None:
        file["floor_plan"] = plan.to_json()
        file["lattice"], file["neighbours"] = grid.lattice, grid.neighbours
        file["states"] = np.stack(np.divmod(np.arange(4 * grid.cells), 4), 1).astype(np.int32)
        file["distances"], file["rooms"] = grid.distances, grid.rooms
        file["squares"], file["sources"] = grid.squares, sources
        file["in_sight"] = in_sight
        file["materials"] = np.array(surfaces.materials, dtype=h5py.string_dtype())

    scene_file.write(path, "geometry", GEOMETRY_VERSION, fingerprint, fill)


def check_plan(plan: FloorPlan) -> tuple[Grid, NDArray[np.int32]]:
    """Check a plan, and return its grid and the cells of its sources.

    Raises
    ------
    UserError
        If the cells are not connected, a source is on no free cell, or a material is unknown.
    """
    grid = build_grid(plan)
    sources = source_cells(plan, grid)
    _check_materials(plan)
    return grid, sources


def _check_materials(plan: FloorPlan) -> None:
    named = [(room.kind, m) for room in plan.rooms for m in (room.floor, room.walls, room.ceiling)]
    for kind, material in [*named, *((piece.kind, piece.material) for piece in plan.furniture)]:
        if material not in NAMES:
            raise UserError(
                f"floor plan {plan.name}: material '{material}' of a {kind} is not known; "
                f"use one of {', '.join(NAMES)}"
            )


@dataclass(frozen=True)
class _Job:
    """Job of a worker: one source of one apartment."""

    plan: FloorPlan
    acoustics: AcousticsConfig
    source: tuple[float, float]
    cells: np.ndarray
    part: Path


def _points(centres: np.ndarray, height: float) -> np.ndarray:
    return np.column_stack([centres, np.full(len(centres), height)])


def _render_reverberation(job: _Job) -> Path:
    surfaces = build_surfaces(job.plan)
    source = np.array([*job.source, job.acoustics.source_height])
    receivers = _points(job.cells, job.acoustics.receiver_height)
    reverberation = brir.render_source(surfaces, source, receivers, job.acoustics)
    with atomic_write(job.part) as part, part.open("wb") as file:
        np.savez(
            file,
            samples=reverberation.samples,
            scale=reverberation.scale,
            cut_db=reverberation.cut_db,
        )
    return job.part


def _render_direct_paths(job: _Job) -> DirectPaths:
    source = np.array([*job.source, job.acoustics.source_height])
    receivers = _points(job.cells, job.acoustics.receiver_height)
    return brir.render_direct_paths(walls(job.plan), source, receivers, job.acoustics)


def sounding_cells(scene: Scene, squares: bool = False) -> NDArray[np.int32]:
    """Return the cells of the sources; with `squares`, every free cell follows them."""
    every = np.arange(scene.grid.cells if squares else 0, dtype=np.int32)
    return np.concatenate((scene.sources, every))


def build_reverberation(
    files: Sequence[tuple[Scene, Path, str]],
    acoustics: AcousticsConfig,
    processes: int,
    squares: bool = False,
) -> None:
    """Render the reverberation of apartments in worker processes, one job for each source.

    The file of an apartment is written as soon as its sources are done. The results do not depend
    on the number of processes.

    Parameters
    ----------
    files : sequence of (Scene, Path, str)
        Each apartment, its file, and the fingerprint of the file.
    acoustics : AcousticsConfig
        Settings.
    processes : int
        Number of worker processes.
    squares : bool
        Whether each free square has a source too; see `sounding_cells`.
    """
    jobs = [_jobs(scene, acoustics, path, squares) for scene, path, _ in files]
    todo = [job for scene_jobs in jobs for job in scene_jobs if not job.part.is_file()]
    left = Parts([[job.part for job in scene_jobs] for scene_jobs in jobs])
    for index in left.whole:
        _assemble(files[index], acoustics, jobs[index])
    total = sum(len(job.cells) for scene_jobs in jobs for job in scene_jobs)
    if todo:
        before = total - sum(len(job.cells) for job in todo)
        with progress_bar("tracing sound", total, "pairs", before) as advance:
            for part in in_processes(_render_reverberation, todo, processes):
                index, is_last = left.finish(part)
                advance(len(jobs[index][0].cells))
                if is_last:
                    _assemble(files[index], acoustics, jobs[index])


def _jobs(scene: Scene, acoustics: AcousticsConfig, path: Path, squares: bool) -> list[_Job]:
    parts, centres = partial_folder(path), scene.grid.centres
    return [
        _Job(scene.plan, acoustics, tuple(centres[cell]), centres, parts / f"source-{k:03d}.npz")
        for k, cell in enumerate(sounding_cells(scene, squares))
    ]


def _assemble(
    to_write: tuple[Scene, Path, str], acoustics: AcousticsConfig, jobs: list[_Job]
) -> None:
    scene, path, fingerprint = to_write
    pairs = (len(jobs), scene.grid.cells)

    def fill(file: h5py.File) -> None:
        samples = round(acoustics.seconds * acoustics.rate)
        shape = (*pairs, 4, 2, samples)
        file.create_dataset("samples", shape, np.int16)  # contiguous, to be memory-mapped
        file.create_dataset("scale", pairs, np.float32)
        file.create_dataset("cut_db", pairs, np.float32)
        for k, job in enumerate(jobs):
            with np.load(job.part) as part:
                for name in ("samples", "scale", "cut_db"):
                    file[name][k] = part[name]

    scene_file.write(path, "acoustics-tail", REVERBERATION_VERSION, fingerprint, fill)
    shutil.rmtree(jobs[0].part.parent)


def build_direct_sound(
    scene: Scene, acoustics: AcousticsConfig, path: Path, fingerprint: str, squares: bool = False
) -> None:
    """Write the direct paths of an apartment in the regime of `acoustics`.

    Parameters
    ----------
    scene : Scene
        The apartment.
    acoustics : AcousticsConfig
        Settings.
    path : Path
        The file.
    fingerprint : str
        Hash of all that the file depends on; it is stored in it.
    squares : bool
        Whether each free square has a source too; see `sounding_cells`.
    """
    paths = [_render_direct_paths(job) for job in _jobs(scene, acoustics, path, squares)]

    def fill(file: h5py.File) -> None:
        file["samples"] = np.stack([p.samples for p in paths])
        file["scale"] = np.stack([p.scale for p in paths])
        file["onset"] = np.stack([p.onset for p in paths])

    scene_file.write(path, "acoustics-first", DIRECT_PATH_VERSION, fingerprint, fill)
