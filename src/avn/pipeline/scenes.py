"""Scenes as stages: the geometry of apartments, their late reverberation and direct sound."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from avn.acoustics import brir
from avn.acoustics.brir import AcousticsConfig, check_config
from avn.apartments.floor_plan import FloorPlan
from avn.core.files import check_name
from avn.core.settings import typed
from avn.dataset import build
from avn.dataset.scene import AudibleScene, Brirs, Scene, load_scene
from avn.pipeline.apartments import (
    Apartments,
    PerApartment,
    check_processes,
    plan_hash,
    scene_folder,
)

# Settings of an acoustic regime; all others shape the reverberation, which regimes share.
_REGIME = ("name", "direct_path")
_HEIGHTS = ("receiver_height", "source_height")


def acoustics_of(apartments: Apartments) -> AcousticsConfig:
    """The acoustics of apartments; raises `UserError` for a value that makes no sense."""
    return check_config(typed(apartments.node("acoustics")), apartments.world.acoustics)


def _keys(apartments: Apartments, names: Sequence[str]) -> list[str]:
    return [f"{apartments.world.acoustics}.{name}" for name in names]


class Geometry(PerApartment):
    """Free cells, shortest distances and lines of sight of apartments."""

    kind = "generate/geometry"

    def settings(self) -> Sequence[str]:
        """The heights of ears and sources, between which there is a line of sight or none."""
        return _keys(self.apartments, _HEIGHTS)

    def content_of(self, plan: FloorPlan) -> Any:
        """The floor plan."""
        return plan_hash(plan)

    @property
    def title(self) -> str:
        """What it is."""
        return f"geometry of {self.apartments.title}"

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """The file of an apartment."""
        return scene_folder(self.cfg, plan) / f"geometry-{fingerprint[:8]}.h5"

    def check(self) -> None:
        """Refuse floor plans and acoustics that cannot be."""
        acoustics_of(self.apartments)
        for plan in self.apartments.plans:
            build.check_plan(plan)

    def make(self) -> None:
        """Write the files that are missing."""
        acoustics = acoustics_of(self.apartments)
        for index in self.missing():
            plan, path = self.apartments.plans[index], self.paths[index]
            build.build_geometry(plan, acoustics, path, self.fingerprints[index])

    def load(self) -> list[Scene]:
        """The scene of each apartment."""
        return [load_scene(*file) for file in zip(self.paths, self.fingerprints, strict=True)]


class _Acoustic(PerApartment):
    """What stages share that are made by the acoustics of a world."""

    def check(self) -> None:
        """Refuse acoustics that cannot be."""
        acoustics_of(self.apartments)
        check_processes(self.cfg)
        check_name(
            f"{self.apartments.world.acoustics}.name", self.apartments.node("acoustics").name
        )


class LateReverberation(_Acoustic):
    """Sound that reaches each cell after reflections, traced; the regimes share it."""

    kind = "generate/late_reverberation"

    def needs(self) -> Sequence[Geometry]:
        """The geometry of the same apartments."""
        return (Geometry(self.cfg, self.apartments),)

    def settings(self) -> Sequence[str]:
        """The acoustics, without what tells the regimes apart."""
        return (self.apartments.world.acoustics,)

    def ignored(self) -> Sequence[str]:
        """What tells the regimes apart."""
        return _keys(self.apartments, _REGIME)

    def content(self) -> Any:
        """The tables of materials and heads."""
        return brir.assets_hash()

    @property
    def title(self) -> str:
        """What it is."""
        return f"reverberation of {self.apartments.title}"

    def seconds(self) -> float:
        """About 20 ms for each pair of source and cell."""
        return self.apartments.pairs * 0.02 / max(1, self.cfg.processes)

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """The file of an apartment."""
        return scene_folder(self.cfg, plan) / f"acoustics-tail-{fingerprint[:8]}.h5"

    def make(self) -> None:
        """Trace what is missing, in worker processes."""
        scenes, acoustics = self.needs()[0].load(), acoustics_of(self.apartments)
        files = [(scenes[i], self.paths[i], self.fingerprints[i]) for i in self.missing()]
        build.build_reverberation(files, acoustics, self.cfg.processes)


class DirectSound(_Acoustic):
    """First arrivals in a regime; with the reverberation these are the impulse responses."""

    kind = "generate/direct_sound"

    def needs(self) -> Sequence[Any]:
        """The geometry and the reverberation of the same apartments."""
        own = (self.cfg, self.apartments)
        return (Geometry(*own), LateReverberation(*own))

    def settings(self) -> Sequence[str]:
        """What tells the regimes apart."""
        return _keys(self.apartments, _REGIME)

    @property
    def title(self) -> str:
        """What it is."""
        return f"sound of {self.apartments.title} ({self.apartments.node('acoustics').name})"

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """The file of an apartment."""
        regime = self.apartments.node("acoustics").name
        return scene_folder(self.cfg, plan) / f"acoustics-{regime}-{fingerprint[:8]}.h5"

    def make(self) -> None:
        """Write the files that are missing."""
        scenes, acoustics = self.needs()[0].load(), acoustics_of(self.apartments)
        for index in self.missing():
            build.build_direct_sound(
                scenes[index], acoustics, self.paths[index], self.fingerprints[index]
            )

    def load(self) -> list[AudibleScene]:
        """The scene of each apartment with its binaural impulse responses."""
        geometry, tails = self.needs()
        tail_files = zip(tails.paths, tails.fingerprints, strict=True)
        first_files = zip(self.paths, self.fingerprints, strict=True)
        return [
            scene.with_brirs(Brirs(tail, first, len(scene.sources), scene.grid.cells))
            for scene, tail, first in zip(geometry.load(), tail_files, first_files, strict=True)
        ]
