"""Furniture of a floor plan as textured triangles.

Grid and acoustics represent a piece by its bounding box. Each model is scaled to exactly that
box, and seen from above it covers at least 80 % of it.
"""

from __future__ import annotations

import hashlib
import math

import numpy as np
from numpy.typing import NDArray

from avn.apartments.floor_plan import FloorPlan, Piece
from avn.views import curtain_model
from avn.views.furniture_models import FurnitureModel, assets_hash, catalogue, load_model
from avn.views.mesh import Mesh, boxes, join

__all__ = ["Mesh", "assets_hash", "choose", "furniture_mesh"]

# A model is eligible if its distortion exceeds the least one by at most this.
_NEARLY = 0.35
# Linear RGB albedo of the plain boxes of pieces without a model, by material.
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


def furniture_mesh(plan: FloorPlan, part: str, appearance_seed: int = 0) -> Mesh:
    """Build the two-sided triangles of all furniture of a plan.

    Parameters
    ----------
    plan : FloorPlan
    part : {"train", "validation", "test"}
        Split part, which selects the models. Parts share neither models nor textures.
    appearance_seed : int
        Seed of the choice of models.

    Returns
    -------
    Mesh
        The bounds of a piece's triangles are those of its bounding box. A piece without a model
        is a plain box in the colour of its material.
    """
    meshes = [_placed(plan, index, part, appearance_seed) for index in range(len(plan.furniture))]
    if not meshes:
        none = np.zeros((0, 3))
        return boxes(none, none, none.astype(np.float32), np.zeros(0, dtype=np.int32))
    return _sharing_pictures(join(meshes))


def choose(
    plan: FloorPlan, index: int, part: str, appearance_seed: int = 0
) -> FurnitureModel | None:
    """Choose the model of a piece among those that are least distorted by scaling to its box.

    The choice is seeded by apartment, room, kind and size, so that equal pieces of one room, such
    as the chairs around a table, look the same.

    Parameters
    ----------
    plan : FloorPlan
    index : int
        Index into `plan.furniture`.
    part : {"train", "validation", "test"}
        Split part, which selects the models.
    appearance_seed : int
        Seed of the choice.

    Returns
    -------
    FurnitureModel or None
        None if no model of the catalogue represents this kind of piece; curtains are not in it.
    """
    piece = plan.furniture[index]
    fits = [model for model in catalogue() if piece.kind in model.kinds and model.pool == part]
    if not fits:
        return None
    costs = [distortion(model, piece) for model in fits]
    near = [model for model, cost in zip(fits, costs, strict=True) if cost <= min(costs) + _NEARLY]
    size = (piece.width, piece.depth, piece.height)
    names = (
        plan.name,
        part,
        appearance_seed,
        _room(plan, piece),
        piece.kind,
        *(f"{x:.3f}" for x in size),
    )
    text = "\x1f".join(str(name) for name in names)
    draw = int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")
    return near[draw % len(near)]


def distortion(model: FurnitureModel, piece: Piece) -> float:
    """Compute the distortion of a model scaled to a piece: log ratio of extreme scale factors."""
    width, depth, height = model.size
    wide = copies(model, piece) * width
    factors = (piece.width / wide, piece.depth / depth, piece.height / height)
    return math.log(max(factors) / min(factors))


def copies(model: FurnitureModel, piece: Piece) -> int:
    """Compute the number of copies of a model that stand side by side in a piece."""
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


def _placed(plan: FloorPlan, index: int, part: str, appearance_seed: int) -> Mesh:
    piece = plan.furniture[index]
    x0, y0, x1, y1 = piece.bounds
    lower = np.array([x0, y0, piece.z])
    upper = np.array([x1, y1, piece.z + piece.height])
    if piece.kind == curtain_model.KIND:
        names = (plan.name, appearance_seed, _room(plan, piece))
        shape, count = curtain_model.curtain(piece, part, *names), 1
    elif (model := choose(plan, index, part, appearance_seed)) is not None:
        shape, count = load_model(model.name), copies(model, piece)
    else:
        colour = np.array([_PLAIN.get(piece.material, _UNKNOWN)], dtype=np.float32)
        return boxes(lower[None], upper[None], colour, np.array([index], dtype=np.int32))
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
    """Scale and shift a model to its place in a row of copies, from left to right."""
    shifted = unit.astype(np.float64)
    shifted[..., 0] = (shifted[..., 0] + place) / count
    return shifted


def _turned(unit: NDArray[np.float64], heading: int) -> NDArray[np.float64]:
    """Rotate from a piece's frame (u, v, w) to east, north and up in its box, each 0 to 1."""
    u, v, w = np.moveaxis(unit, -1, 0)
    # (east, north) for pieces that face north, east, south, west
    east, north = ((u, v), (v, 1 - u), (1 - u, 1 - v), (1 - v, u))[heading % 4]
    return np.stack((east, north, w), axis=-1)


def _sharing_pictures(mesh: Mesh) -> Mesh:
    """Merge identical textures of a mesh."""
    first: dict[int, int] = {}
    pictures: list[NDArray[np.uint8]] = []
    renamed = np.full(len(mesh.textures) + 1, -1, dtype=np.int32)
    for index, picture in enumerate(mesh.textures):
        # `load_model` returns the same array for all pieces with the same model.
        if id(picture) not in first:
            first[id(picture)] = len(pictures)
            pictures.append(picture)
        renamed[index] = first[id(picture)]
    return Mesh(
        mesh.vertices, mesh.uv, renamed[mesh.texture], mesh.colour, tuple(pictures), mesh.piece
    )
