"""Furniture models of the package: their catalogue and their triangles.

`assets/furniture/catalogue.json` lists for each model its name, the kinds of piece that it can
represent, its split part (`pool`: train, validation or test), true size, author and licence. Its
triangles are in `<id>.npz`, made by `scripts/extract_furniture.py`:

- `points` (P, 3) uint16: vertices in the frame of the piece, v forward (the way the piece faces),
  u to the right of forward, w up; 0 and 65535 are the faces of its bounding box;
- `uv` (P, 2) float32, v up, if the model has textures;
- `faces` (T, 3) uint16: indices of three points each. Triangles are two-sided;
- `material` (T,) uint8, `colour` (M, 3) float32 linear, `texture` (M,) int8 (-1: plain colour);
- `picture_0`, `picture_1`, ... uint8: the bytes of JPEG files.
"""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

FOLDER = Path(__file__).parents[1] / "assets" / "furniture"
# Largest coordinate of `points`.
STEPS = 65535


@dataclass(frozen=True)
class FurnitureModel:
    """Catalogue entry of a furniture model.

    Attributes
    ----------
    name : str
        Its file is `<name>.npz`.
    kinds : tuple of str
        Kinds of piece that it can represent.
    pool : str
        Split part that uses it: train, validation or test.
    size : tuple of float
        True width, depth and height in metres.
    row : bool
        True if copies may stand side by side in one wide piece, such as cupboards.
    title, author, licence, source : str
        Attribution of the original work.
    """

    name: str
    kinds: tuple[str, ...]
    pool: str
    size: tuple[float, float, float]
    row: bool
    title: str
    author: str
    licence: str
    source: str


@dataclass(frozen=True)
class ModelTriangles:
    """T triangles in the frame of the piece, with coordinates from 0 to 1.

    Attributes
    ----------
    vertices : (T, 3, 3) float32
        u right, v forward, w up.
    uv : (T, 3, 2) float32
        Texture coordinates, v up.
    texture : (T,) int32
        Index into `pictures`; -1 for plain colour.
    colour : (T, 3) float32
        Linear RGB albedo.
    pictures : tuple of (h, w, 3) uint8
        sRGB textures.
    """

    vertices: NDArray[np.float32]
    uv: NDArray[np.float32]
    texture: NDArray[np.int32]
    colour: NDArray[np.float32]
    pictures: tuple[NDArray[np.uint8], ...]


@cache
def catalogue() -> tuple[FurnitureModel, ...]:
    """Load the catalogue of all models, in the order of its file."""
    rows = json.loads((FOLDER / "catalogue.json").read_text(encoding="utf-8"))
    return tuple(
        FurnitureModel(**{**row, "kinds": tuple(row["kinds"]), "size": tuple(row["size"])})
        for row in rows
    )


@lru_cache(maxsize=256)
def load_model(name: str) -> ModelTriangles:
    """Load the triangles of a model; the cached arrays must not be modified."""
    with np.load(FOLDER / f"{name}.npz") as data:
        faces = data["faces"].astype(np.int64)
        vertices = (data["points"].astype(np.float32) / np.float32(STEPS))[faces]
        uv = data["uv"][faces] if "uv" in data else np.zeros((*faces.shape, 2), dtype=np.float32)
        material = data["material"]
        texture = data["texture"].astype(np.int32)
        pictures = tuple(
            np.array(Image.open(io.BytesIO(data[f"picture_{i}"].tobytes())).convert("RGB"))
            for i in range(int(texture.max(initial=-1)) + 1)
        )
        return ModelTriangles(vertices, uv, texture[material], data["colour"][material], pictures)


@cache
def assets_hash() -> str:
    """Return a hash of the catalogue and all models, for fingerprints of rendered views."""
    content = hashlib.sha256()
    for path in sorted([FOLDER / "catalogue.json", *FOLDER.glob("*.npz")]):
        content.update(path.name.encode())
        content.update(hashlib.sha256(path.read_bytes()).digest())
    return content.hexdigest()
