"""Makes scene folders from floor plans: geometry at once, acoustics a source at a time.

Each source's responses are kept in a file of their own until all of an apartment are there,
so that a killed run goes on where it was.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import h5py
import numpy as np

from avn.acoustics import brir
from avn.acoustics.brir import AcousticsConfig
from avn.acoustics.first_arrival import FirstArrivals
from avn.acoustics.materials import NAMES
from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import build_grid, source_cells
from avn.apartments.surfaces import build_surfaces, line_of_sight
from avn.apartments.walls import walls
from avn.core.errors import UserError
from avn.core.files import written_whole
from avn.core.hashing import digest
from avn.core.processes import in_processes
from avn.core.progress import progress_bar
from avn.dataset import scene, scene_file
from avn.dataset.scene import Scene

# Raised when the code of a part changes what it makes. All enter every hash, for cells,
# reverberation and first arrivals lie in one folder and must be of one making.
MAKING = {"geometry": 1, "tail": 1, "first_arrival": 1}
_REGIME = ("name", "first_arrival")


def geometry_hash(plan: FloorPlan, acoustics: AcousticsConfig) -> str:
    """Hash of what a geometry file is made from."""
    heights = (acoustics.ear_height, acoustics.source_height)
    return digest(plan.to_dict(), heights, MAKING)


def tail_hash(plan: FloorPlan, acoustics: AcousticsConfig) -> str:
    """Hash of what the traced reverberation is made from; the regime is no part of it."""
    settings = {key: value for key, value in asdict(acoustics).items() if key not in _REGIME}
    return digest(plan.to_dict(), settings, brir.assets_hash(), MAKING)


def first_arrival_hash(plan: FloorPlan, acoustics: AcousticsConfig) -> str:
    """Hash of what the first arrivals of a regime are made from."""
    regime = [getattr(acoustics, key) for key in _REGIME]
    return digest(tail_hash(plan, acoustics), regime)


def build_geometry(plan: FloorPlan, acoustics: AcousticsConfig, folder: Path) -> Scene:
    """Write `geometry.h5` unless it is there, and open the scene.

    Raises
    ------
    UserError
        Where the plan's cells do not hang together or a source stands on none.
    """
    path = scene.geometry_file(folder)
    made_from = geometry_hash(plan, acoustics)
    if not path.is_file():
        grid = build_grid(plan)
        sources = source_cells(plan, grid)
        surfaces = build_surfaces(plan)
        _check_materials(plan)
        ears = _points(grid.centres, acoustics.ear_height)
        places = _points(grid.centres[sources], acoustics.source_height)
        pairs = (len(sources), grid.cells, 3)
        in_sight = line_of_sight(
            surfaces,
            np.broadcast_to(places[:, None], pairs).reshape(-1, 3),
            np.broadcast_to(ears[None], pairs).reshape(-1, 3),
        ).reshape(pairs[:2])

        def fill(file: h5py.File) -> None:
            file["floor_plan"] = plan.to_json()
            file["lattice"], file["neighbours"] = grid.lattice, grid.neighbours
            file["states"] = np.stack(np.divmod(np.arange(4 * grid.cells), 4), 1).astype(np.int32)
            file["distances"], file["rooms"] = grid.distances, grid.rooms
            file["squares"], file["sources"] = grid.squares, sources
            file["in_sight"] = in_sight
            file["materials"] = np.array(surfaces.materials, dtype=h5py.string_dtype())

        scene_file.write(path, "geometry", scene.GEOMETRY_VERSION, made_from, fill)
    return scene.load(folder, made_from)


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
    """What a worker needs to render one source of one apartment."""

    plan: FloorPlan
    acoustics: AcousticsConfig
    source: tuple[float, float]
    cells: np.ndarray
    part: Path


def _points(centres: np.ndarray, height: float) -> np.ndarray:
    return np.column_stack([centres, np.full(len(centres), height)])


def _render_tail(job: _Job) -> int:
    surfaces = build_surfaces(job.plan)
    source = np.array([*job.source, job.acoustics.source_height])
    ears = _points(job.cells, job.acoustics.ear_height)
    tail = brir.render_source(surfaces, source, ears, job.acoustics)
    with written_whole(job.part) as part, part.open("wb") as file:
        np.savez(file, samples=tail.samples, scale=tail.scale, cut_db=tail.cut_db)
    return len(job.cells)


def _render_first_arrivals(job: _Job) -> FirstArrivals:
    source = np.array([*job.source, job.acoustics.source_height])
    ears = _points(job.cells, job.acoustics.ear_height)
    return brir.render_first_arrivals(walls(job.plan), source, ears, job.acoustics)


def acoustics_made(scenes: Sequence[Scene], acoustics: AcousticsConfig) -> bool:
    """Whether all files of a regime are there; whether they are whole shows on reading.

    Raises
    ------
    UserError
        Where a file was made from other settings.
    """
    return all(_tail_made(s, acoustics) and _first_made(s, acoustics) for s in scenes)


def _tail_made(which: Scene, acoustics: AcousticsConfig) -> bool:
    path = scene.tail_file(which.folder)
    return scene_file.is_there(path, tail_hash(which.plan, acoustics))


def _first_made(which: Scene, acoustics: AcousticsConfig) -> bool:
    path = scene.first_arrival_file(which.folder, acoustics.name)
    return scene_file.is_there(path, first_arrival_hash(which.plan, acoustics))


def build_acoustics(scenes: Sequence[Scene], acoustics: AcousticsConfig, processes: int) -> None:
    """Make the acoustics files that are missing, one source a job, in worker processes.

    The results do not depend on the number of processes.
    """
    missing = [which for which in scenes if not _tail_made(which, acoustics)]
    jobs = {which.name: _jobs(which, acoustics) for which in missing}
    todo = [job for name in jobs for job in jobs[name] if not job.part.is_file()]
    total = sum(len(job.cells) for which in jobs.values() for job in which)
    if total:
        with progress_bar("tracing sound", total, "pairs") as advance:
            advance(total - sum(len(job.cells) for job in todo))
            for done in in_processes(_render_tail, todo, processes):
                advance(done)
    for which in missing:
        _assemble_tail(which, acoustics, jobs[which.name])
    for which in scenes:
        if not _first_made(which, acoustics):
            _write_first_arrivals(which, acoustics)


def _jobs(which: Scene, acoustics: AcousticsConfig) -> list[_Job]:
    made_from = tail_hash(which.plan, acoustics)
    parts = which.folder / f".tail-{made_from[:8]}"
    centres = which.grid.centres
    return [
        _Job(which.plan, acoustics, tuple(centres[cell]), centres, parts / f"source-{k:03d}.npz")
        for k, cell in enumerate(which.sources)
    ]


def _assemble_tail(which: Scene, acoustics: AcousticsConfig, jobs: list[_Job]) -> None:
    pairs = (len(jobs), which.grid.cells)

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

    made_from = tail_hash(which.plan, acoustics)
    path = scene.tail_file(which.folder)
    scene_file.write(path, "acoustics-tail", scene.TAIL_VERSION, made_from, fill)
    shutil.rmtree(jobs[0].part.parent)


def _write_first_arrivals(which: Scene, acoustics: AcousticsConfig) -> None:
    arrivals = [_render_first_arrivals(job) for job in _jobs(which, acoustics)]

    def fill(file: h5py.File) -> None:
        file.attrs["tail_made_from"] = tail_hash(which.plan, acoustics)
        file["samples"] = np.stack([a.samples for a in arrivals])
        file["scale"] = np.stack([a.scale for a in arrivals])
        file["onset"] = np.stack([a.onset for a in arrivals])

    path = scene.first_arrival_file(which.folder, acoustics.name)
    kind = f"acoustics-{acoustics.name}"
    made_from = first_arrival_hash(which.plan, acoustics)
    scene_file.write(path, kind, scene.FIRST_ARRIVAL_VERSION, made_from, fill)
