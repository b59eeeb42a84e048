"""Stage of rendered views of every state."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from avn.apartments.floor_plan import FloorPlan
from avn.core.errors import UserError
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
    """Stage of RGB and depth views of every state.

    Parameters
    ----------
    cfg : DictConfig
        Config of a command.
    apartments : Apartments
        Apartments to render.
    appearance_seed : int
        Number of the sample of furniture models, textures and light from the subset's pool.
    """

    kind = "generate/views"

    def __init__(self, cfg: DictConfig, apartments: Apartments, appearance_seed: int = 0) -> None:
        super().__init__(cfg, apartments)
        self.appearance_seed = appearance_seed

    def settings(self) -> Sequence[str]:
        """Return the key of the renderer."""
        return ("renderer",)

    def content(self) -> Any:
        """Return the subset's pool, the sample's number, and the hash of the assets."""
        return self.apartments.subset, self.appearance_seed, assets_hash()

    def content_of(self, plan: FloorPlan) -> Any:
        """Return the hash of the floor plan."""
        return plan_hash(plan)

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        name = self.cfg.renderer.name
        return f"views of {self.apartments.title} ({name}" + (
            f", appearance {self.appearance_seed})" if self.appearance_seed else ")"
        )

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """Return the path of an apartment's file."""
        name = f"views-{self.cfg.renderer.name}-{fingerprint[:8]}.h5"
        return scene_folder(self.cfg, plan) / name

    def seconds(self) -> float:
        """Estimate 30 ms per view, and 25 s per apartment for its light."""
        seconds = 4 * self.cells_left() * 0.03 + 25 * len(self.missing())
        return seconds / max(1, self.cfg.processes)

    def check(self) -> None:
        """Refuse an invalid renderer, and apartments without light."""
        check_processes(self.cfg)
        check_name("renderer.name", self.cfg.renderer.name)
        renderer = typed(self.cfg.renderer)
        renderer_class(renderer).check(renderer)
        for plan in self.apartments.plans:
            if not plan.lamps and not plan.windows:
                raise UserError(
                    f"floor plan {plan.name}: has no lamp and no window, so its views would be "
                    "black; add one to its file"
                )

    def make(self) -> None:
        """Render the missing files in worker processes."""
        files = [
            ViewsFile(
                self.apartments.plans[i],
                self.apartments.subset,
                self.appearance_seed,
                self.paths[i],
                self.fingerprints[i],
            )
            for i in self.missing()
        ]
        build_views(files, typed(self.cfg.renderer), self.cfg.processes)

    def load(self) -> list[Views]:
        """Return the views of each apartment, memory-mapped from the files."""
        files = zip(self.apartments.plans, self.paths, self.fingerprints, strict=True)
        return [
            read_views(path, 4 * cells_of(plan), fingerprint) for plan, path, fingerprint in files
        ]
