"""Rendering of the views of apartments in worker processes.

The lighting of an apartment is computed once, then its views are rendered in chunks. Both are kept
in temporary files until all are done, so that an interrupted run can be resumed.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.grid import build_grid
from avn.core.files import atomic_write, partial_folder
from avn.core.processes import in_processes
from avn.core.progress import progress_bar
from avn.dataset import scene_file
from avn.dataset.parts import Parts
from avn.dataset.views import KIND, VERSION
from avn.views.renderer import Prepared, Renderer, renderer_class
from avn.views.settings import RendererConfig

# Views that are rendered, kept and counted together.
_CHUNK = 40


@dataclass(frozen=True)
class ViewsFile:
    """Description of a file with the views of an apartment.

    Attributes
    ----------
    plan : FloorPlan
        The apartment.
    part : {"train", "validation", "test"}
        Pool of models, patterns and light.
    appearance_seed : int
        Index of the draw from the pool.
    path : Path
        The file.
    fingerprint : str
        Hash of all that the file depends on; it is stored in it.
    """

    plan: FloorPlan
    part: str
    appearance_seed: int
    path: Path
    fingerprint: str


@dataclass(frozen=True)
class _Lighting:
    """Job of a worker: the lighting of an apartment."""

    views: ViewsFile
    cfg: RendererConfig

    @property
    def file(self) -> Path:
        """Temporary file of the lighting."""
        return partial_folder(self.views.path) / "light.npz"


@dataclass(frozen=True)
class _Rendering:
    """Job of a worker: the views of the states from `first` to `last`, the latter excluded."""

    lighting: _Lighting
    centres: NDArray[np.float64]
    first: int
    last: int
    file: Path


def build_views(files: Sequence[ViewsFile], cfg: RendererConfig, processes: int) -> None:
    """Render views, in worker processes of one thread each.

    The file of an apartment is written as soon as its views are done. The results do not depend on
    the number of processes.

    Parameters
    ----------
    files : sequence of ViewsFile
        Files to write.
    cfg : RendererConfig
        Settings.
    processes : int
        Number of worker processes.

    Raises
    ------
    UserError
        If a setting is out of range, or the renderer is not installed.
    """
    renderer_class(cfg).check(cfg)
    lightings = [_Lighting(own, cfg) for own in files]
    unlit = [job for job in lightings if not job.file.is_file()]
    if unlit:
        before = len(lightings) - len(unlit)
        with progress_bar("lighting", len(lightings), "apartments", before) as advance:
            for done in in_processes(_light, unlit, processes):
                advance(done)
    chunks = [_renderings(light) for light in lightings]
    todo = [job for own in chunks for job in own if not job.file.is_file()]
    left = Parts([[job.file for job in own] for own in chunks])
    for index in left.whole:
        _assemble(files[index], cfg, chunks[index])
    if todo:
        total = sum(job.last - job.first for own in chunks for job in own)
        before = total - sum(job.last - job.first for job in todo)
        with progress_bar("rendering", total, "views", before) as advance:
            for part, count in in_processes(_render, todo, processes):
                index, is_last = left.finish(part)
                advance(count)
                if is_last:
                    _assemble(files[index], cfg, chunks[index])
        _OPENED.clear()


def _renderings(lighting: _Lighting) -> list[_Rendering]:
    centres, folder = build_grid(lighting.views.plan).centres, lighting.file.parent
    states = 4 * len(centres)
    return [
        _Rendering(
            lighting,
            centres,
            first,
            min(first + _CHUNK, states),
            folder / f"states-{first:05d}.npz",
        )
        for first in range(0, states, _CHUNK)
    ]


def _open(job: _Lighting, light: Prepared | None = None) -> Renderer:
    views = job.views
    return renderer_class(job.cfg)(job.cfg, views.plan, views.part, views.appearance_seed, light)


def _light(job: _Lighting) -> int:
    renderer = _open(job)
    with atomic_write(job.file) as part, part.open("wb") as file:
        np.savez(file, **renderer.prepare())  # type: ignore[arg-type]
    return 1


# Renderer of this process's current apartment, kept from one chunk to the next.
_OPENED: dict[Path, Renderer] = {}


def _renderer(job: _Lighting) -> Renderer:
    if job.file not in _OPENED:
        with np.load(job.file) as light:
            prepared = dict(light)
        _OPENED.clear()
        _OPENED[job.file] = _open(job, prepared)
    return _OPENED[job.file]


def _render(job: _Rendering) -> tuple[Path, int]:
    states = np.arange(job.first, job.last)
    rgb, depth = _renderer(job.lighting).views(job.centres[states // 4], states % 4)
    with atomic_write(job.file) as part, part.open("wb") as file:
        np.savez(file, rgb=rgb, depth=depth)
    return job.file, len(states)


def _assemble(views: ViewsFile, cfg: RendererConfig, chunks: list[_Rendering]) -> None:
    size, states = cfg.camera.size, chunks[-1].last

    def fill(file: h5py.File) -> None:
        # contiguous, to be memory-mapped
        file.create_dataset("rgb", (states, size, size, 3), np.uint8)
        file.create_dataset("depth", (states, size, size), np.float16)
        for job in chunks:
            with np.load(job.file) as made:
                for name in ("rgb", "depth"):
                    file[name][job.first : job.last] = made[name]

    scene_file.write(views.path, KIND, VERSION, views.fingerprint, fill)
    shutil.rmtree(chunks[0].file.parent)
