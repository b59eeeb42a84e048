"""Views of every state of apartments as a stage."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from avn.apartments.floor_plan import FloorPlan
from avn.core.files import check_name
from avn.core.settings import typed
from avn.dataset.build_views import ViewsFile, build_views
from avn.dataset.views import Views, read_views
from avn.pipeline.apartments import (
    Apartments,
    PerApartment,
    cells_of,
    check_processes,
    plan_hash,
    scene_folder,
)
from avn.views.models import assets_hash
from avn.views.renderer import renderer_class


class RenderedViews(PerApartment):
    """RGB and depth of every state of apartments.

    Parameters
    ----------
    cfg : DictConfig
    apartments : Apartments
    appearance_seed : int
        Which draw of furniture, patterns and light from the pool of their part.
    """

    kind = "generate/views"

    def __init__(self, cfg: DictConfig, apartments: Apartments, appearance_seed: int = 0) -> None:
        super().__init__(cfg, apartments)
        self.appearance_seed = appearance_seed

    def settings(self) -> Sequence[str]:
        """What renders them."""
        return ("renderer",)

    def content(self) -> Any:
        """The pool, the draw from it, and the assets."""
        return self.apartments.part, self.appearance_seed, assets_hash()

    def content_of(self, plan: FloorPlan) -> Any:
        """The floor plan."""
        return plan_hash(plan)

    @property
    def title(self) -> str:
        """What it is."""
        name = self.cfg.renderer.name
        return f"views of {self.apartments.title} ({name}" + (
            f", appearance {self.appearance_seed})" if self.appearance_seed else ")"
        )

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """The file of an apartment."""
        name = f"views-{self.cfg.renderer.name}-{fingerprint[:8]}.h5"
        return scene_folder(self.cfg, plan) / name

    def seconds(self) -> float:
        """About 60 ms a view, and a minute an apartment for its light."""
        apartments = self.apartments
        seconds = 4 * apartments.cells * 0.06 + 60 * len(apartments.plans)
        return seconds / max(1, self.cfg.processes)

    def check(self) -> None:
        """Refuse a renderer that cannot work."""
        check_processes(self.cfg)
        check_name("renderer.name", self.cfg.renderer.name)
        renderer = typed(self.cfg.renderer)
        renderer_class(renderer).check(renderer)

    def make(self) -> None:
        """Render what is missing, in worker processes."""
        files = [
            ViewsFile(
                self.apartments.plans[i],
                self.apartments.part,
                self.appearance_seed,
                self.paths[i],
                self.fingerprints[i],
            )
            for i in self.missing()
        ]
        build_views(files, typed(self.cfg.renderer), self.cfg.processes)

    def load(self) -> list[Views]:
        """The views of each apartment, mapped from the files."""
        files = zip(self.apartments.plans, self.paths, self.fingerprints, strict=True)
        return [read_views(path, 4 * cells_of(plan), own) for plan, path, own in files]
