"""Stand-in until the models are there: coloured boxes."""

import numpy as np

from avn.apartments.floor_plan import FloorPlan
from avn.views.drawing import draw
from avn.views.mesh import Mesh, boxes

try:
    from avn.views.furniture_models import catalogue

    catalogue()
    from avn.views.models import assets_hash, furniture_mesh
except (ImportError, OSError):

    def assets_hash() -> str:
        return "boxes"

    def furniture_mesh(plan: FloorPlan, part: str, look: int = 0) -> Mesh:
        lo, hi, col = [], [], []
        for i, p in enumerate(plan.furniture):
            x0, y0, x1, y1 = p.bounds
            lo.append((x0, y0, p.z))
            hi.append((x1, y1, p.z + p.height))
            col.append(draw("box", part, plan.name, i, look).uniform(0.08, 0.7, 3))
        n = len(lo)
        return boxes(
            np.array(lo).reshape(-1, 3),
            np.array(hi).reshape(-1, 3),
            np.array(col, np.float32).reshape(-1, 3),
            np.arange(n, dtype=np.int32),
        )
