"""Take furniture models out of Debian's package sweethome3d-furniture.

    apt-get download sweethome3d-furniture
    dpkg -x sweethome3d-furniture_*.deb unpacked
    python scripts/extract_furniture.py unpacked [name ...]

Which models, for which kinds of piece and which pool, is in `furniture_list.py`. They are turned
into the frame of a piece, cut down where they have more triangles than a small picture can show,
and stored as `avn.views.furniture_models` says. The same package gives the same bytes. With
names only those models are made again.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import sys
import tempfile
import zipfile
from collections import defaultdict
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from furniture_credits import AUTHORS, LIBRARIES, credits_of, licences
from furniture_entries import Entry, Slab, Source
from furniture_list import ENTRIES
from furniture_shapes import Look, Shape, bent, box, cut_down, unit
from numpy.typing import NDArray
from PIL import Image

from avn.views.furniture_models import FOLDER, STEPS
from avn.views.obj_files import GLASS, read_obj

# Longest side of a picture, and how well JPEG keeps it.
PICTURE, QUALITY = 256, 85
# Albedos stay in the range of real surfaces.
DARKEST, BRIGHTEST = 0.015, 0.85


@dataclass
class Origin:
    """Record of a model in its library."""

    title: str
    author: str
    licence: str
    source: str
    size: tuple[float, float, float]
    path: Path
    rotation: NDArray[np.float64] | None


class Libraries:
    """The libraries of the package, unpacked to a folder."""

    def __init__(self, package: Path, folder: Path) -> None:
        self._origins: dict[str, Origin] = {}
        for short, (name, licence) in LIBRARIES.items():
            found = sorted(package.rglob(f"{name}.sh3f"))
            if not found:
                raise SystemExit(f"{name}.sh3f is not under {package}")
            with zipfile.ZipFile(found[0]) as archive:
                archive.extractall(folder / name)
            self._read(short, folder / name, name, licence)

    def _read(self, short: str, folder: Path, library: str, licence: str) -> None:
        text = (folder / "PluginFurnitureCatalog.properties").read_text(encoding="latin-1")
        rows: dict[str, dict[str, str]] = defaultdict(dict)
        for key, number, value in re.findall(r"^(\w+)#(\d+)\s*=\s*(.*?)\s*$", text, re.M):
            rows[number][key] = value
        for row in rows.values():
            path = folder / row["model"].lstrip("/")
            size = [float(row[key]) / 100 for key in ("width", "depth", "height")]
            turned = row.get("modelRotation")
            rotation = np.array(turned.split(), float).reshape(3, 3) if turned else None
            self._origins[f"{short}/{path.stem}"] = Origin(
                row["name"],
                AUTHORS.get(row["creator"], f"{row['creator']} (blendswap.com)"),
                licence,
                f"{library}/{path.stem}",
                (size[0], size[1], size[2]),
                path,
                rotation,
            )

    def origin(self, name: str) -> Origin:
        """Return the record of `library/model`."""
        return self._origins[name]

    def shape(self, name: str) -> Shape:
        """Return the model in the frame of a piece, u and v and w each from 0 to 1."""
        origin = self.origin(name)
        model = read_obj(origin.path)
        at = model.vertices
        if origin.rotation is not None:
            at = at @ origin.rotation.T
        # The files have y up and their front at z; u is to the right of who looks that way.
        at = np.stack((-at[..., 0], at[..., 2], at[..., 1]), axis=-1)
        looks = [
            (GLASS if m.clear else m.colour, None if m.clear else m.image) for m in model.materials
        ]
        return Shape(unit(at), model.uv, model.material.astype(np.int64), looks)


def put_together(entry: Entry, libraries: Libraries) -> Shape:
    """Join the parts of an entry to one shape."""
    vertices, uv, look = [], [], []
    looks: list[Look] = []
    for part in entry.parts:
        shape = box(part) if isinstance(part, Slab) else bent(part, libraries.shape(part.name))
        low, high = np.array(part.at[:3]), np.array(part.at[3:])
        vertices.append(low + shape.vertices * (high - low))
        uv.append(shape.uv)
        look.append(shape.look + len(looks))
        for colour, picture in shape.looks:
            tint = entry.tint if isinstance(part, Source) else (1.0, 1.0, 1.0)
            red, green, blue = (
                float(min(max(c * t, DARKEST), BRIGHTEST))
                for c, t in zip(colour, tint, strict=True)
            )
            looks.append(((0.9, 0.9, 0.9) if picture else (red, green, blue), picture))
    return Shape(unit(np.concatenate(vertices)), np.concatenate(uv), np.concatenate(look), looks)


@cache
def picture(path: Path) -> bytes:
    """Scale a picture of a library down and return the bytes of a JPEG file."""
    with Image.open(path) as image:
        rgba = image.convert("RGBA")
    # What is cut out of a leaf's picture takes the colour of what is left.
    pixels = np.array(rgba, dtype=np.float64)
    solid = pixels[..., 3] > 127
    if solid.any():
        pixels[~solid, :3] = pixels[solid, :3].mean(axis=0)
    rgb = Image.fromarray(pixels[..., :3].astype(np.uint8))
    rgb.thumbnail((PICTURE, PICTURE), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    rgb.save(stream, "JPEG", quality=QUALITY)
    return stream.getvalue()


def store(name: str, shape: Shape) -> set[str]:
    """Write a model's file and return the hashes of its pictures."""
    used, look = np.unique(shape.look, return_inverse=True)
    looks = [shape.looks[i] for i in used]
    paths = sorted({path for _, path in looks if path is not None})
    texture = [paths.index(path) if path is not None else -1 for _, path in looks]
    quantised = np.round(shape.vertices * STEPS).astype(np.uint16).reshape(-1, 3)
    textured = np.array(texture)[look.reshape(-1)] >= 0
    uv = np.where(textured[:, None, None], shape.uv, 0.0).astype(np.float32).reshape(-1, 2)
    corners = np.concatenate([quantised.astype(np.float64), uv.astype(np.float64)], axis=1)
    unique, faces = np.unique(corners, axis=0, return_inverse=True)
    if len(unique) > STEPS:
        raise SystemExit(f"{name}: {len(unique)} corners are more than 16 bits can number")
    arrays = {
        "points": unique[:, :3].astype(np.uint16),
        "faces": faces.reshape(-1, 3).astype(np.uint16),
        "material": look.reshape(-1).astype(np.uint8),
        "colour": np.array([colour for colour, _ in looks], dtype=np.float32),
        "texture": np.array(texture, dtype=np.int8),
    }
    if paths:
        arrays["uv"] = unique[:, 3:].astype(np.float32)
    for i, path in enumerate(paths):
        arrays[f"picture_{i}"] = np.frombuffer(picture(path), dtype=np.uint8)
    np.savez_compressed(FOLDER / f"{name}.npz", **arrays)
    return {hashlib.sha256(picture(path)).hexdigest() for path in paths}


def true_size(entry: Entry, libraries: Libraries) -> tuple[float, float, float]:
    """Return width, depth and height in metres of the part of the model that is kept."""
    if entry.size:
        return entry.size
    source = next(part for part in entry.parts if isinstance(part, Source))
    size = list(libraries.origin(source.name).size)
    for axis, knots in source.bend.items():
        size["uvw".index(axis)] *= knots[-1][0] - knots[0][0]
    return round(size[0], 4), round(size[1], 4), round(size[2], 4)


def row_of(entry: Entry, name: str, libraries: Libraries) -> dict[str, Any]:
    """Build the entry's row of the catalogue."""
    origins = [libraries.origin(p.name) for p in entry.parts if isinstance(p, Source)]
    return {
        "name": name,
        "kinds": entry.kinds.split(),
        "pool": entry.pool,
        "size": true_size(entry, libraries),
        "row": entry.row,
        "title": ", ".join(o.title for o in origins) or name.replace("_", " ").capitalize(),
        "author": ", ".join(dict.fromkeys(o.author for o in origins)) or "the authors of avn",
        "licence": " and ".join(dict.fromkeys(o.licence for o in origins)) or "Apache-2.0",
        "source": ", ".join(o.source for o in origins) or "made of boxes",
    }


def name_of(entry: Entry) -> str:
    """Return the name of an entry: its own, or that of its only source."""
    source = next((part.name for part in entry.parts if isinstance(part, Source)), "")
    return entry.name or re.sub(r"\W", "_", source).lower()


def main() -> None:
    """Write the models, the catalogue, the credits and the licences."""
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    package, only = Path(sys.argv[1]), set(sys.argv[2:])
    FOLDER.mkdir(parents=True, exist_ok=True)
    entries = {name_of(entry): entry for entry in ENTRIES}
    for old in FOLDER.glob("*.npz"):
        if not only or old.stem not in entries:
            old.unlink()
    pools: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        libraries = Libraries(package, Path(folder))
        for name, entry in entries.items():
            if only and name not in only:
                continue
            size = true_size(entry, libraries)
            shape = cut_down(put_together(entry, libraries), size, entry.triangles)
            for digest in store(name, shape):
                if pools.setdefault(digest, entry.pool) != entry.pool:
                    raise SystemExit(f"{name}: has a picture of the pool {pools[digest]}")
            print(f"{name}: {len(shape.vertices)} triangles", flush=True)
        rows = [row_of(entry, name, libraries) for name, entry in sorted(entries.items())]
    text = json.dumps(rows, indent=1, ensure_ascii=False) + "\n"
    (FOLDER / "catalogue.json").write_text(text, encoding="utf-8")
    (FOLDER / "README.md").write_text(credits_of(rows), encoding="utf-8")
    for licence, lines in licences(package).items():
        (FOLDER / f"LICENSE.{licence}.txt").write_text(lines, encoding="utf-8")


if __name__ == "__main__":
    main()
