"""Stages of scenes: geometry, late reverberation and direct sound of apartments."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from avn.acoustics import brir
from avn.acoustics.brir import check_config
from avn.acoustics.settings import AcousticsConfig
from avn.apartments.floor_plan import FloorPlan
from avn.core.files import check_name
from avn.core.settings import typed
from avn.dataset import build
from avn.dataset.build import sounding_cells
from avn.dataset.scene import AudibleScene, Brirs, Scene, load_scene
from avn.pipeline.apartments import (
    TEST,
    Apartments,
    PerApartment,
    cells_of,
    check_processes,
    plan_hash,
    scene_folder,
)

# Settings of an acoustic regime; the others change the reverberation, which regimes share.
_REGIME = ("name", "direct_path")
# The fingerprints hold what it refers to, so that a default run finds products of before it.
_HEAD = ("head",)
_HEIGHTS = ("receiver_height", "source_height")


def acoustics_of(apartments: Apartments) -> AcousticsConfig:
    """Return the acoustics of apartments; raise `UserError` for an invalid value."""
    return check_config(typed(apartments.node("acoustics")), apartments.world.acoustics)


def _keys(apartments: Apartments, names: Sequence[str]) -> list[str]:
    return [f"{apartments.world.acoustics}.{name}" for name in names]


class Geometry(PerApartment):
    """Stage of free cells, shortest distances and lines of sight."""

    kind = "generate/geometry"

    def settings(self) -> Sequence[str]:
        """Return the keys of the heights of receiver and source, which the lines of sight use."""
        return _keys(self.apartments, _HEIGHTS)

    def content_of(self, plan: FloorPlan) -> Any:
        """Return the hash of the floor plan."""
        return plan_hash(plan)

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return f"geometry of {self.apartments.title}"

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """Return the path of an apartment's file."""
        return scene_folder(self.cfg, plan) / f"geometry-{fingerprint[:8]}.h5"

    def check(self) -> None:
        """Refuse invalid floor plans and acoustics."""
        acoustics_of(self.apartments)
        for plan in self.apartments.plans:
            build.check_plan(plan)

    def make(self) -> None:
        """Compute and write the missing files."""
        acoustics = acoustics_of(self.apartments)
        for index in self.missing():
            plan, path = self.apartments.plans[index], self.paths[index]
            build.build_geometry(plan, acoustics, path, self.fingerprints[index])

    def load(self) -> list[Scene]:
        """Return the scene of each apartment."""
        return [load_scene(*file) for file in zip(self.paths, self.fingerprints, strict=True)]


class _Acoustic(PerApartment):
    """Base class of the stages of a world's acoustics.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.
    apartments : Apartments
        Apartments of the files.
    squares : bool
        Whether the responses of a source on each free square follow those of the sources.
    """

    def __init__(self, cfg: DictConfig, apartments: Apartments, squares: bool = False) -> None:
        super().__init__(cfg, apartments)
        self.squares = squares

    def content(self) -> Any:
        """Return that each square has a source, if it has."""
        return "squares" if self.squares else None

    def pairs_left(self) -> int:
        """Return the number of pairs of source and free cell of the apartments without a file."""
        plans = [self.apartments.plans[index] for index in self.missing()]
        every = sum(cells_of(plan) ** 2 for plan in plans) if self.squares else 0
        return super().pairs_left() + every

    @property
    def _part(self) -> str:
        """Part of the name of a file."""
        return "acoustics-squares" if self.squares else "acoustics"

    def check(self) -> None:
        """Refuse invalid acoustics."""
        acoustics_of(self.apartments)
        check_processes(self.cfg)
        check_name(
            f"{self.apartments.world.acoustics}.name", self.apartments.node("acoustics").name
        )


class LateReverberation(_Acoustic):
    """Stage of late reverberation by ray tracing; acoustic regimes share it."""

    kind = "generate/late_reverberation"

    def needs(self) -> Sequence[Geometry]:
        """Return the stage of the geometry."""
        return (Geometry(self.cfg, self.apartments),)

    def settings(self) -> Sequence[str]:
        """Return the key of the acoustics."""
        return (self.apartments.world.acoustics,)

    def ignored(self) -> Sequence[str]:
        """Return the keys of the acoustic regime and of the head."""
        return _keys(self.apartments, (*_REGIME, *_HEAD))

    def consulted(self) -> Sequence[str]:
        """Return the keys of the split and of the head; `content` holds the head's responses."""
        return (*super().consulted(), *_keys(self.apartments, _HEAD))

    def content(self) -> Any:
        """Return the hash of the tables of materials and head-related impulse responses."""
        (key,) = _keys(self.apartments, _HEAD)
        tables = brir.assets_hash(self.apartments.node("acoustics").head, key)
        return [tables, super().content()] if self.squares else tables

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        squares = "each square of " if self.squares else ""
        return f"reverberation of {squares}{self.apartments.title}"

    def seconds(self) -> float:
        """Estimate 20 ms per pair of source and cell."""
        return self.pairs_left() * 0.02 / max(1, self.cfg.processes)

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """Return the path of an apartment's file."""
        return scene_folder(self.cfg, plan) / f"{self._part}-tail-{fingerprint[:8]}.h5"

    def make(self) -> None:
        """Trace the missing files in worker processes."""
        scenes, acoustics = self.needs()[0].load(), acoustics_of(self.apartments)
        files = [(scenes[i], self.paths[i], self.fingerprints[i]) for i in self.missing()]
        build.build_reverberation(files, acoustics, self.cfg.processes, self.squares)


class DirectSound(_Acoustic):
    """Stage of direct sound in an acoustic regime, the early part of the impulse responses."""

    kind = "generate/direct_sound"
    version = 2  # air absorbs the direct sound

    def needs(self) -> Sequence[Any]:
        """Return the stages of geometry and late reverberation, whose fingerprint has the head."""
        arguments = (self.cfg, self.apartments)
        return (Geometry(*arguments), LateReverberation(*arguments, self.squares))

    def settings(self) -> Sequence[str]:
        """Return the keys of the acoustic regime, and of absorption by air."""
        return _keys(self.apartments, (*_REGIME, "air"))

    def consulted(self) -> Sequence[str]:
        """Return the keys of the split and of the head, which enters by the reverberation."""
        return (*super().consulted(), *_keys(self.apartments, _HEAD))

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        squares = "each square of " if self.squares else ""
        regime = self.apartments.node("acoustics").name
        return f"sound of {squares}{self.apartments.title} ({regime})"

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """Return the path of an apartment's file."""
        regime = self.apartments.node("acoustics").name
        return scene_folder(self.cfg, plan) / f"{self._part}-{regime}-{fingerprint[:8]}.h5"

    def make(self) -> None:
        """Compute and write the missing files."""
        scenes, acoustics = self.needs()[0].load(), acoustics_of(self.apartments)
        for index in self.missing():
            file = self.paths[index], self.fingerprints[index]
            build.build_direct_sound(scenes[index], acoustics, *file, self.squares)

    def load(self) -> list[AudibleScene]:
        """Return the scene of each apartment with its binaural room impulse responses."""
        geometry, tails = self.needs()
        tail_files = zip(tails.paths, tails.fingerprints, strict=True)
        first_files = zip(self.paths, self.fingerprints, strict=True)
        files = zip(geometry.load(), tail_files, first_files, strict=True)
        return [
            scene.with_brirs(
                Brirs(tail, first, len(sounding_cells(scene, self.squares)), scene.grid.cells)
            )
            for scene, tail, first in files
        ]


def heard_sound(cfg: DictConfig, apartments: Apartments) -> DirectSound:
    """Return the stage of the responses that agents hear.

    Where sources move, they are those of each square of the test apartments too.
    """
    moves = apartments.world == TEST and cfg.motion._target_ is not None
    return DirectSound(cfg, apartments, squares=moves)
