"""Curtains as triangles: hanging folds, in colours of the split part."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import Piece
from avn.views.drawing import draw, to_linear
from avn.views.furniture_models import ModelTriangles

KIND = "curtain"
# sRGB colours of the cloth, 0 to 255. No colour is in two parts.
CLOTHS = {
    "train": (
        (214, 204, 184),
        (128, 138, 120),
        (96, 104, 128),
        (168, 112, 96),
        (230, 226, 216),
        (112, 88, 84),
    ),
    "validation": ((204, 196, 178), (108, 124, 138), (150, 128, 92), (126, 96, 112)),
    "test": ((222, 214, 200), (122, 116, 104), (86, 116, 116), (184, 140, 110), (146, 92, 88)),
}
# Width of a fold in metres, and the depth of its valleys as a share of the depth of the curtain.
_FOLD, _VALLEY = 0.1, 0.3


def curtain(piece: Piece, part: str, *names: object) -> ModelTriangles:
    """Build a curtain in folds, closed at all sides.

    Parameters
    ----------
    piece : Piece
        The curtain; the number of folds follows from its width.
    part : {"train", "validation", "test"}
        Split part, which selects the colours.
    *names
        Seed of the colour: curtains of the same names have the same one.
    """
    folds = max(2, round(piece.width / _FOLD))
    u = np.linspace(0.0, 1.0, 2 * folds + 1)
    front = np.where(np.arange(len(u)) % 2, 1.0, 1.0 - _VALLEY)
    outline = np.stack((np.append(u, u[::-1]), np.append(front, np.zeros_like(u))), axis=-1)
    vertices = np.concatenate((_sides(outline), _lid(u, front, 0.0), _lid(u, front, 1.0)))
    cloths = CLOTHS[part]
    colour = to_linear(np.array(cloths[draw("curtain", part, *names).integers(len(cloths))]) / 255)
    count = len(vertices)
    return ModelTriangles(
        vertices=vertices.astype(np.float32),
        uv=np.zeros((count, 3, 2), dtype=np.float32),
        texture=np.full(count, -1, dtype=np.int32),
        colour=np.tile(colour.astype(np.float32), (count, 1)),
        pictures=(),
    )


def _quads(a: NDArray, b: NDArray, c: NDArray, d: NDArray) -> NDArray[np.float64]:
    """Divide quadrilaterals with corners (N, 3) into triangles."""
    return np.concatenate((np.stack((a, b, c), axis=1), np.stack((a, c, d), axis=1)))


def _at(points: NDArray, height: float) -> NDArray[np.float64]:
    return np.column_stack((points, np.full(len(points), height)))


def _sides(outline: NDArray[np.float64]) -> NDArray[np.float64]:
    """Extrude a closed outline (N, 2) from the lower to the upper end."""
    after = np.roll(outline, -1, axis=0)
    return _quads(_at(outline, 0.0), _at(after, 0.0), _at(after, 1.0), _at(outline, 1.0))


def _lid(u: NDArray, front: NDArray, height: float) -> NDArray[np.float64]:
    """Close one end, between the back at v = 0 and the folds."""
    near = _at(np.stack((u, front), axis=-1), height)
    back = _at(np.stack((u, np.zeros_like(u)), axis=-1), height)
    return _quads(back[:-1], back[1:], near[1:], near[:-1])
