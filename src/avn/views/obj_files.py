"""Reader of Wavefront OBJ files with materials, as triangles.

The supported part of the format is polygons with texture coordinates (`v`, `vt`, `f`), plain
colours (`Kd`), transparency (`d`, `Tr`) and images (`map_Kd`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

# Opaque linear RGB colour that replaces glass, a pale blue-green.
GLASS = (0.62, 0.72, 0.72)
# Largest opacity of a clear material.
_CLEAR = 0.5


@dataclass(frozen=True)
class Material:
    """Material of an MTL file.

    Attributes
    ----------
    colour : tuple of float
        Linear RGB.
    opacity : float
        0 to 1.
    image : Path, optional
        Texture.
    """

    colour: tuple[float, float, float] = (0.6, 0.6, 0.6)
    opacity: float = 1.0
    image: Path | None = None

    @property
    def clear(self) -> bool:
        """True if the opacity is below 0.5."""
        return self.opacity < _CLEAR


@dataclass(frozen=True)
class ObjModel:
    """T triangles of an OBJ file.

    Attributes
    ----------
    vertices : (T, 3, 3) float64
        Units and axes of the file.
    uv : (T, 3, 2) float64
        Texture coordinates, v up; 0 if the file has none.
    material : (T,) int32
        Index into `materials`.
    materials : tuple of Material
    """

    vertices: NDArray[np.float64]
    uv: NDArray[np.float64]
    material: NDArray[np.int32]
    materials: tuple[Material, ...]


def read_obj(path: Path) -> ObjModel:
    """Read an OBJ file and the MTL files that it names.

    Triangles without area are dropped, since they have no normal. Negative indices count from
    the end. An undefined material is plain grey. A material whose image is missing keeps its
    plain colour.
    """
    points: list[list[float]] = []
    coordinates: list[list[float]] = []
    library: dict[str, Material] = {}
    names: dict[str, int] = {"": 0}
    corners: list[tuple[int, int]] = []
    polygons: list[tuple[int, int, int]] = []  # first corner, number of corners, material
    current = 0
    for line in path.read_text(encoding="latin-1").splitlines():
        key, rest = _words(line)
        if key == "v":
            points.append([float(x) for x in rest.split()[:3]])
        elif key == "vt":
            coordinates.append([float(x) for x in [*rest.split(), "0"][:2]])
        elif key == "mtllib":
            library.update(read_mtl(path.parent / rest))
        elif key == "usemtl":
            current = names.setdefault(rest, len(names))
        elif key == "f":
            own = [_corner(word, len(points), len(coordinates)) for word in rest.split()]
            polygons.append((len(corners), len(own), current))
            corners.extend(own)
    at = np.array(points, dtype=np.float64).reshape(-1, 3)
    # The last row is for corners without texture coordinates, whose index is -1.
    uv = np.array([*coordinates, [0.0, 0.0]], dtype=np.float64)
    fan: list[tuple[int, int, int]] = []
    material: list[int] = []
    for first, count, own_material in polygons:
        ring = at[[corner[0] for corner in corners[first : first + count]]]
        own_fan = [(first + a, first + b, first + c) for a, b, c in triangulate(ring)]
        fan.extend(own_fan)
        material.extend([own_material] * len(own_fan))
    index = np.array(corners, dtype=np.int64).reshape(-1, 2)[np.array(fan).reshape(-1, 3)]
    vertices = at[index[..., 0]]
    edges = vertices[:, 1:] - vertices[:, :1]
    size = np.linalg.norm(np.ptp(at, axis=0)) if len(at) else 0.0
    keep = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1) > 1e-10 * size**2
    return ObjModel(
        vertices[keep],
        uv[index[..., 1]][keep],
        np.array(material, dtype=np.int32)[keep],
        tuple(library.get(name, Material()) for name in names),
    )


def _words(line: str) -> tuple[str, str]:
    """Split a line into its key and the rest."""
    key, *rest = line.split(None, 1) or [""]
    return key, rest[0].strip() if rest else ""


def _corner(word: str, points: int, coordinates: int) -> tuple[int, int]:
    parts = word.split("/")
    point = int(parts[0])
    uv = int(parts[1]) if len(parts) > 1 and parts[1] else 0
    point = point - 1 if point > 0 else points + point
    return point, uv - 1 if uv > 0 else (coordinates + uv if uv < 0 else -1)


def triangulate(ring: NDArray[np.float64]) -> list[tuple[int, int, int]]:
    """Triangulate a polygon.

    A convex polygon becomes a fan. For others ears are clipped in the plane of the polygon
    (Meisters, "Polygons have ears", American Mathematical Monthly 1975).

    Parameters
    ----------
    ring : (N, 3) float64
        Vertices in order.

    Returns
    -------
    list of (int, int, int)
        Vertex indices of the triangles.
    """
    count = len(ring)
    if count < 3:
        return []
    if count == 3:
        return [(0, 1, 2)]
    # Newell's method: a normal of twice the polygon's area, also if it is not planar.
    normal = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    sides = np.roll(ring, -1, axis=0) - ring
    turns = np.cross(sides, np.roll(sides, -1, axis=0)) @ normal
    if (turns >= -1e-12 * abs(turns).max()).all():
        return [(0, i, i + 1) for i in range(1, count - 1)]
    drop = int(np.argmax(abs(normal)))
    flat = np.delete(ring, drop, axis=1)
    # Mirror if needed, so that the vertices run counter-clockwise.
    if (normal[drop] < 0) != (drop == 1):
        flat[:, 0] *= -1.0
    return _clip_ears(flat)


def _clip_ears(flat: NDArray[np.float64]) -> list[tuple[int, int, int]]:
    left = list(range(len(flat)))
    ears: list[tuple[int, int, int]] = []
    while len(left) > 3:
        for place in range(len(left)):
            a, b, c = left[place - 1], left[place], left[(place + 1) % len(left)]
            others = flat[[i for i in left if i not in (a, b, c)]]
            if _area(flat[a], flat[b], flat[c]) > 0 and not _inside(others, flat[[a, b, c]]).any():
                ears.append((a, b, c))
                left.pop(place)
                break
        else:
            # Sides cross or vertices coincide: the rest becomes a fan.
            break
    return ears + [(left[0], left[i], left[i + 1]) for i in range(1, len(left) - 1)]


def _area(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _inside(points: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    inside = np.ones(len(points), dtype=bool)
    for i in range(3):
        a, b = corners[i], corners[(i + 1) % 3]
        side = (b[0] - a[0]) * (points[:, 1] - a[1]) - (b[1] - a[1]) * (points[:, 0] - a[0])
        inside &= side > 0
    return inside


def read_mtl(path: Path) -> dict[str, Material]:
    """Read the materials of an MTL file by name; empty if the file is missing.

    `Kd` is interpreted as sRGB, as most viewers do.
    """
    found: dict[str, Material] = {}
    if not path.is_file():
        return found
    name = ""
    for line in path.read_text(encoding="latin-1").splitlines():
        key, rest = _words(line)
        if key == "newmtl":
            name = rest
            found[name] = Material()
        elif not name:
            continue
        elif key == "Kd":
            red, green, blue = (to_linear(float(x)) for x in rest.split()[:3])
            found[name] = _changed(found[name], colour=(red, green, blue))
        elif key == "d":
            found[name] = _changed(found[name], opacity=float(rest.split()[-1]))
        elif key == "Tr":
            found[name] = _changed(found[name], opacity=1.0 - float(rest.split()[-1]))
        elif key == "map_Kd":
            found[name] = _changed(found[name], image=_image(path.parent, rest))
    return found


def _changed(material: Material, **values: object) -> Material:
    return Material(**{**vars(material), **values})  # type: ignore[arg-type]


def _image(folder: Path, words: str) -> Path | None:
    """Find the image that `map_Kd` names, with or without options, if Pillow can open it."""
    for name in (words, words.split()[-1]):
        path = folder / name.replace("\\", "/")
        if path.is_file():
            try:
                with Image.open(path) as image:
                    image.verify()
            except OSError:
                return None
            return path
    return None


def to_linear(value: float) -> float:
    """Convert an sRGB value to linear, both 0 to 1 (IEC 61966-2-1)."""
    value = min(max(value, 0.0), 1.0)
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
