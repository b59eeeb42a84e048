"""Makes the views of apartments, in worker processes.

An apartment is lit once, then its views are rendered some at a time; light and views are kept
in files of their own until all are there, so that a killed run goes on where it was.
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
from avn.core.files import written_whole
from avn.core.hashing import digest
from avn.core.processes import in_processes
from avn.core.progress import progress_bar
from avn.dataset import scene_file
from avn.dataset.scene import Scene
from avn.dataset.views import VERSION, views_file, views_kind
from avn.views.models import assets_hash
from avn.views.renderer import Renderer, RendererConfig, renderer_class

# Raised when the code changes what it makes.
MAKING = 1
# Views that are rendered, kept and counted together.
_CHUNK = 40


def views_hash(plan: FloorPlan, part: str, cfg: RendererConfig, look: int = 0) -> str:
    """Hash of what a file of views is made from.

    Parameters
    ----------
    plan : FloorPlan
    part : {"train", "validation", "test"}
        The pool of models, patterns and light.
    cfg : RendererConfig
    look : int
        Which draw from the pool.
    """
    return digest(plan.to_dict(), part, cfg, look, assets_hash(), MAKING)


@dataclass(frozen=True)
class _Lighting:
    """What a worker needs to light an apartment."""

    plan: FloorPlan
    part: str
    look: int
    cfg: RendererConfig
    file: Path


@dataclass(frozen=True)
class _Rendering:
    """Views of the states from `first` up to `last`."""

    lighting: _Lighting
    centres: NDArray[np.float64]
    first: int
    last: int
    file: Path


Apartments = Sequence[tuple[Scene, str]]


def views_made(apartments: Apartments, cfg: RendererConfig, looks: Sequence[int] = (0,)) -> bool:
    """Whether all files of views are there; whether they are whole shows on reading.

    Parameters and errors are those of `build_views`.
    """
    return all(
        scene_file.is_there(
            views_file(which.folder, cfg.name, look), views_hash(which.plan, part, cfg, look)
        )
        for which, part in apartments
        for look in looks
    )


def build_views(
    apartments: Apartments, cfg: RendererConfig, processes: int, looks: Sequence[int] = (0,)
) -> None:
    """Make the files of views that are missing, in worker processes of one thread each.

    The results do not depend on the number of processes.

    Parameters
    ----------
    apartments : sequence of (Scene, str)
        Scenes, and the part of the split that each belongs to.
    cfg : RendererConfig
    processes : int
    looks : sequence of int
        Which looks of each.

    Raises
    ------
    UserError
        Where a file was made from other settings, or the renderer is not installed.
    """
    renderer_class(cfg).check(cfg)
    missing = [
        (which, part, look)
        for which, part in apartments
        for look in looks
        if not views_made([(which, part)], cfg, [look])
    ]
    lightings = [_lighting(*each, cfg) for each in missing]
    unlit = [job for job in lightings if not job.file.is_file()]
    if unlit:
        with progress_bar("lighting", len(lightings), "apartments") as advance:
            advance(len(lightings) - len(unlit))
            for done in in_processes(_light, unlit, processes):
                advance(done)
    chunks = [
        _renderings(which, light) for (which, _, _), light in zip(missing, lightings, strict=True)
    ]
    todo = [job for own in chunks for job in own if not job.file.is_file()]
    if todo:
        total = sum(4 * which.grid.cells for which, _, _ in missing)
        with progress_bar("rendering", total, "views") as advance:
            advance(total - sum(job.last - job.first for job in todo))
            for done in in_processes(_render, todo, processes):
                advance(done)
        _OPENED.clear()
    for (which, part, look), own in zip(missing, chunks, strict=True):
        _assemble(which, part, look, cfg, own)


def _lighting(which: Scene, part: str, look: int, cfg: RendererConfig) -> _Lighting:
    made_from = views_hash(which.plan, part, cfg, look)
    folder = which.folder / f".{views_kind(cfg.name, look)}-{made_from[:8]}"
    return _Lighting(which.plan, part, look, cfg, folder / "light.npz")


def _renderings(which: Scene, lighting: _Lighting) -> list[_Rendering]:
    centres, folder = which.grid.centres, lighting.file.parent
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


def _light(job: _Lighting) -> int:
    renderer = renderer_class(job.cfg)(job.cfg, job.plan, job.part, job.look)
    with written_whole(job.file) as part, part.open("wb") as file:
        np.savez(file, **renderer.prepare())  # type: ignore[arg-type]
    return 1


# The renderer of the apartment that this process is at, kept from one chunk to the next.
_OPENED: dict[Path, Renderer] = {}


def _renderer(job: _Lighting) -> Renderer:
    if job.file not in _OPENED:
        with np.load(job.file) as light:
            prepared = dict(light)
        _OPENED.clear()
        _OPENED[job.file] = renderer_class(job.cfg)(job.cfg, job.plan, job.part, job.look, prepared)
    return _OPENED[job.file]


def _render(job: _Rendering) -> int:
    states = np.arange(job.first, job.last)
    rgb, depth = _renderer(job.lighting).views(job.centres[states // 4], states % 4)
    with written_whole(job.file) as part, part.open("wb") as file:
        np.savez(file, rgb=rgb, depth=depth)
    return len(states)


def _assemble(
    which: Scene, part: str, look: int, cfg: RendererConfig, chunks: list[_Rendering]
) -> None:
    size = cfg.camera.size
    states = 4 * which.grid.cells

    def fill(file: h5py.File) -> None:
        # contiguous, to be memory-mapped
        file.create_dataset("rgb", (states, size, size, 3), np.uint8)
        file.create_dataset("depth", (states, size, size), np.float16)
        for job in chunks:
            with np.load(job.file) as made:
                for name in ("rgb", "depth"):
                    file[name][job.first : job.last] = made[name]

    path = views_file(which.folder, cfg.name, look)
    made_from = views_hash(which.plan, part, cfg, look)
    scene_file.write(path, views_kind(cfg.name, look), VERSION, made_from, fill)
    shutil.rmtree(chunks[0].file.parent)
