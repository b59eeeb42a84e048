"""Scene of an apartment: geometry, materials and light sources, shared by all renderers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan
from avn.views.building import building_mesh
from avn.views.lights import Lamps, Panes, lamps_and_panes, light_of
from avn.views.mesh import Mesh, join
from avn.views.models import furniture_mesh


@dataclass(frozen=True)
class SceneMesh:
    """Furnished apartment with its light sources.

    Attributes
    ----------
    mesh : Mesh
        T triangles; those of the building face its interior.
    emission : (T, 3) float32
        Linear RGB that a triangle adds to the image, as exposed; multiplied by its texture. 0
        for most triangles.
    radiance : (T, 3) float32
        Linear RGB radiance with which a triangle lights others, as in `lamps` and `panes`.
    occluder : (T,) bool
        True if the triangle casts shadows; lamp meshes do not.
    lamps : Lamps
    panes : Panes
    """

    mesh: Mesh
    emission: NDArray[np.float32]
    radiance: NDArray[np.float32]
    occluder: NDArray[np.bool_]
    lamps: Lamps
    panes: Panes


def scene_mesh(plan: FloorPlan, part: str, appearance_seed: int = 0) -> SceneMesh:
    """Build the scene of a floor plan.

    Parameters
    ----------
    plan : FloorPlan
    part : {"train", "validation", "test"}
        Split part, which selects furniture models and appearance palette.
    appearance_seed : int
        Seed of the random choices among them.
    """
    light = light_of(plan, part, appearance_seed)
    lamps, panes = lamps_and_panes(plan, light)
    building = building_mesh(plan, part, appearance_seed, light)
    furniture = furniture_mesh(plan, part, appearance_seed)
    dark = np.zeros((len(furniture), 3), dtype=np.float32)
    return SceneMesh(
        mesh=join((building.mesh, furniture)),
        emission=np.concatenate((building.emission, dark)),
        radiance=np.concatenate((building.radiance, dark)),
        occluder=np.concatenate((building.occluder, np.ones(len(furniture), dtype=bool))),
        lamps=lamps,
        panes=panes,
    )
