"""Furniture of a floor plan as textured triangles.

Grid and acoustics have a piece as its box, so each model is scaled to that box exactly: nothing
leaves it, and seen from above it fills at least 80 % of it.
"""

from __future__ import annotations

import hashlib
import math

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan, Piece
from avn.views.furniture_models import FurnitureModel, assets_hash, catalogue, load_model
from avn.views.mesh import Mesh, boxes, join

__all__ = ["Mesh", "assets_hash", "choose", "furniture_mesh"]

# Models whose distortion is at most this much over the best one's are as good as that one.
_NEARLY = 0.35
# Plain boxes for kinds of piece that no model stands for: linear albedo by material.
_PLAIN = {
    "wood": (0.36, 0.22, 0.12),
    "laminate": (0.62, 0.60, 0.56),
    "metal": (0.50, 0.51, 0.52),
    "glass": (0.60, 0.70, 0.70),
    "ceramic": (0.78, 0.78, 0.76),
    "mattress": (0.66, 0.64, 0.60),
    "fabric": (0.24, 0.30, 0.36),
    "upholstery": (0.30, 0.26, 0.24),
    "books": (0.30, 0.18, 0.14),
}
_UNKNOWN = (0.5, 0.5, 0.5)


def furniture_mesh(plan: FloorPlan, part: str, look: int = 0) -> Mesh:
    """Triangles of all pieces of a plan, to be seen from both sides.

    Parameters
    ----------
    plan : FloorPlan
    part : str
        `train`, `validation` or `test`: the pool of models that the apartment draws from. Pools
        share neither models nor pictures.
    look : int
        Another number is another choice of models from the same pool.

    Returns
    -------
    Mesh
        Each piece's triangles reach to all six faces of its box and no further. A kind of piece
        that no model stands for is a plain box in the colour of its material.
    """
    meshes = [_placed(plan, index, part, look) for index in range(len(plan.furniture))]
    if not meshes:
        none = np.zeros((0, 3))
        return boxes(none, none, none.astype(np.float32), np.zeros(0, dtype=np.int32))
    return _sharing_pictures(join(meshes))


def choose(plan: FloorPlan, index: int, part: str, look: int = 0) -> FurnitureModel | None:
    """The model that stands for a piece; None if there is none for its kind.

    Among the pool's models of the kind, one of those that are least distorted when they are
    scaled to the piece. Which one depends on the apartment, the room, the kind and the size:
    equal pieces of one room, such as the chairs round a table, are alike.
    """
    piece = plan.furniture[index]
    fits = [model for model in catalogue() if piece.kind in model.kinds and model.pool == part]
    if not fits:
        return None
    costs = [distortion(model, piece) for model in fits]
    near = [model for model, cost in zip(fits, costs, strict=True) if cost <= min(costs) + _NEARLY]
    size = (piece.width, piece.depth, piece.height)
    names = (plan.name, part, look, _room(plan, piece), piece.kind, *(f"{x:.3f}" for x in size))
    text = "\x1f".join(str(name) for name in names)
    draw = int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")
    return near[draw % len(near)]


def distortion(model: FurnitureModel, piece: Piece) -> float:
    """How unevenly a model is scaled to fill a piece: log of the largest to the least factor."""
    width, depth, height = model.size
    wide = copies(model, piece) * width
    factors = (piece.width / wide, piece.depth / depth, piece.height / height)
    return math.log(max(factors) / min(factors))


def copies(model: FurnitureModel, piece: Piece) -> int:
    """How many of a model stand side by side in a piece."""
    if not model.row:
        return 1
    width, depth, height = model.size
    scale = math.sqrt(piece.depth / depth * piece.height / height)
    return max(1, round(piece.width / (width * scale)))


def _room(plan: FloorPlan, piece: Piece) -> int:
    for index, room in enumerate(plan.rooms):
        if room.x0 <= piece.x <= room.x1 and room.y0 <= piece.y <= room.y1:
            return index
    return -1


def _placed(plan: FloorPlan, index: int, part: str, look: int) -> Mesh:
    piece = plan.furniture[index]
    x0, y0, x1, y1 = piece.bounds
    lower = np.array([x0, y0, piece.z])
    upper = np.array([x1, y1, piece.z + piece.height])
    model = choose(plan, index, part, look)
    if model is None:
        colour = np.array([_PLAIN.get(piece.material, _UNKNOWN)], dtype=np.float32)
        return boxes(lower[None], upper[None], colour, np.array([index], dtype=np.int32))
    shape = load_model(model.name)
    count = copies(model, piece)
    unit = np.concatenate([_shifted(shape.vertices, i, count) for i in range(count)])
    vertices = lower + _turned(unit, piece.heading) * (upper - lower)
    return Mesh(
        vertices=vertices.clip(lower, upper).astype(np.float32),
        uv=np.tile(shape.uv, (count, 1, 1)),
        texture=np.tile(shape.texture, count),
        colour=np.tile(shape.colour, (count, 1)),
        textures=shape.pictures,
        piece=np.full(len(unit), index, dtype=np.int32),
    )


def _shifted(unit: NDArray[np.float32], place: int, count: int) -> NDArray[np.float64]:
    """The model at a place of a row from left to right."""
    shifted = unit.astype(np.float64)
    shifted[..., 0] = (shifted[..., 0] + place) / count
    return shifted


def _turned(unit: NDArray[np.float64], heading: int) -> NDArray[np.float64]:
    """From the piece's frame (u, v, w) to east, north and up within its box, each 0 to 1."""
    u, v, w = np.moveaxis(unit, -1, 0)
    # East and north of a piece that faces north, east, south, west.
    east, north = ((u, v), (v, 1 - u), (1 - u, 1 - v), (1 - v, u))[heading % 4]
    return np.stack((east, north, w), axis=-1)


def _sharing_pictures(mesh: Mesh) -> Mesh:
    """The same mesh with each picture held once."""
    first: dict[int, int] = {}
    pictures: list[NDArray[np.uint8]] = []
    renamed = np.full(len(mesh.textures) + 1, -1, dtype=np.int32)
    for index, picture in enumerate(mesh.textures):
        # `load_model` gives the same array to all pieces that share a model.
        if id(picture) not in first:
            first[id(picture)] = len(pictures)
            pictures.append(picture)
        renamed[index] = first[id(picture)]
    return Mesh(
        mesh.vertices, mesh.uv, renamed[mesh.texture], mesh.colour, tuple(pictures), mesh.piece
    )
