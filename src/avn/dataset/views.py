"""The views of an apartment as `views-<renderer>.h5` in its scene folder holds them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from avn.dataset import scene_file

# Raised when the layout of the file changes.
VERSION = 1


@dataclass(frozen=True)
class Views:
    """The views of an apartment's S states, 4 x cell + heading.

    Attributes
    ----------
    rgb : (S, H, W, 3) uint8
        sRGB, row 0 at the top; mapped from the file, read when it is asked for.
    depth : (S, H, W) float16
        Metres along the camera's axis to what the middle of the pixel shows; 0 for nothing.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float16]


def views_kind(renderer: str, look: int) -> str:
    """What a file of views says it holds; its name too."""
    return f"views-{renderer}" + (f"-look{look}" if look else "")


def views_file(folder: Path, renderer: str, look: int = 0) -> Path:
    """The file of the views by a renderer in one of an apartment's looks."""
    return folder / f"{views_kind(renderer, look)}.h5"


def read_views(
    folder: Path, renderer: str, states: int, made_from: str | None = None, look: int = 0
) -> Views:
    """Open the views of a scene folder.

    Parameters
    ----------
    folder : Path
    renderer : str
    states : int
        How many there must be.
    made_from : str, optional
        The hash that they must carry.
    look : int

    Raises
    ------
    UserError
        Where the file is missing, damaged or of another making.
    """
    path = views_file(folder, renderer, look)
    kind = views_kind(renderer, look)
    with scene_file.open_checked(path, kind, VERSION, made_from) as file:
        size = file["rgb"].shape[1] if "rgb" in file and file["rgb"].ndim == 4 else 0
        shapes = {"rgb": (states, size, size, 3), "depth": (states, size, size)}
        scene_file.check_shapes(file, path, shapes)
        return Views(_mapped(file["rgb"], path), _mapped(file["depth"], path))


def _mapped(dataset: h5py.Dataset, path: Path) -> np.memmap:
    return np.memmap(path, dataset.dtype, "r", dataset.id.get_offset(), dataset.shape)
