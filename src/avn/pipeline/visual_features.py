"""Stage of visual embeddings, features of views by a pre-trained backbone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from avn.apartments.floor_plan import FloorPlan
from avn.core.files import check_name
from avn.core.progress import progress_bar
from avn.core.settings import typed
from avn.dataset.features import read_features, write_features
from avn.pipeline.apartments import PerApartment, cells_of, scene_folder
from avn.pipeline.views import RenderedViews
from avn.views.backbone import backbone_class, backbone_hash, features


class VisualEmbeddings(PerApartment):
    """Stage of visual embeddings of every view."""

    kind = "generate/visual_embeddings"

    def needs(self) -> Sequence[RenderedViews]:
        """Return the stage of the views."""
        return (RenderedViews(self.cfg, self.apartments),)

    def consulted(self) -> Sequence[str]:
        """Return the keys of split and backbone; the fingerprint holds their content instead."""
        return (*super().consulted(), "backbone")

    def content(self) -> Any:
        """Return the hash of the backbone's weights and input size."""
        return backbone_hash(typed(self.cfg.backbone))

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return f"visual embeddings of {self.apartments.title} ({self.cfg.backbone.name})"

    def path_of(self, plan: FloorPlan, fingerprint: str) -> Path:
        """Return the path of an apartment's file."""
        name = f"features-{self.cfg.backbone.name}-{fingerprint[:8]}.h5"
        return scene_folder(self.cfg, plan) / name

    def seconds(self) -> float:
        """Estimate 4 ms per view."""
        return 4 * self.cells_left() * 0.004

    def check(self) -> None:
        """Refuse a name that is no valid file name."""
        check_name("backbone.name", self.cfg.backbone.name)

    def make(self) -> None:
        """Compute the missing embeddings."""
        config = typed(self.cfg.backbone)
        backbone = backbone_class(config)(config)
        views = self.needs()[0].load()
        for index in self.missing():
            rgb, name = views[index].rgb, self.apartments.plans[index].name
            with progress_bar(f"features of {name}", len(rgb), "views") as done:
                embeddings = features(backbone, rgb, done)
            write_features(self.paths[index], embeddings, self.fingerprints[index])

    def load(self) -> list[Tensor]:
        """Return the embeddings of each apartment, (S, D) float32, L2-normalised."""
        files = zip(self.apartments.plans, self.paths, self.fingerprints, strict=True)
        return [
            torch.from_numpy(read_features(path, 4 * cells_of(plan), fingerprint))
            for plan, path, fingerprint in files
        ]
