"""All that a view of an apartment shows, and what lights it; every renderer draws the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan
from avn.views.building import building
from avn.views.lights import Lamps, Panes, lamps_and_panes, light_of
from avn.views.mesh import Mesh, join
from avn.views.models import furniture_mesh


@dataclass(frozen=True)
class Scenery:
    """A furnished and lit apartment.

    Attributes
    ----------
    mesh : Mesh
        T triangles; those of the building face the air.
    glow : (T, 3) float32
        Light that the film gets of a triangle by itself, exposed; it multiplies the texture. 0 for
        most.
    shine : (T, 3) float32
        Radiance with which it lights others, as `lamps` and `panes` have it.
    shade : (T,) bool
        Whether it keeps light off others; lamps' own fixtures do not.
    lamps : Lamps
    panes : Panes
    """

    mesh: Mesh
    glow: NDArray[np.float32]
    shine: NDArray[np.float32]
    shade: NDArray[np.bool_]
    lamps: Lamps
    panes: Panes


def scenery(plan: FloorPlan, part: str, look: int = 0) -> Scenery:
    """Build, furnish and light an apartment.

    Parameters
    ----------
    plan : FloorPlan
    part : {"train", "validation", "test"}
        Which pool of models, patterns and light it draws from.
    look : int
        Another number is another draw from the same pool.
    """
    light = light_of(plan, part, look)
    lamps, panes = lamps_and_panes(plan, light)
    shell = building(plan, part, look, light)
    furniture = furniture_mesh(plan, part, look)
    dark = np.zeros((len(furniture), 3), dtype=np.float32)
    return Scenery(
        mesh=join((shell.mesh, furniture)),
        glow=np.concatenate((shell.glow, dark)),
        shine=np.concatenate((shell.shine, dark)),
        shade=np.concatenate((shell.shade, np.ones(len(furniture), dtype=bool))),
        lamps=lamps,
        panes=panes,
    )
