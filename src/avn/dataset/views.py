"""Views of an apartment, read from their file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from avn.dataset import scene_file

KIND = "views"
# Raised when the layout of the file changes.
VERSION = 1


@dataclass(frozen=True)
class Views:
    """Views of an apartment's S states, 4 x cell + heading.

    Attributes
    ----------
    rgb : (S, H, W, 3) uint8
        sRGB, row 0 at the top; memory-mapped from the file.
    depth : (S, H, W) float16
        Depth along the camera's axis at the middle of the pixel, metres; 0 for no surface.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float16]


def read_views(path: Path, states: int, fingerprint: str | None = None) -> Views:
    """Open the views of an apartment.

    Parameters
    ----------
    path : Path
        The file `views-*.h5`.
    states : int
        Expected number of states.
    fingerprint : str, optional
        Expected fingerprint; None accepts any.

    Raises
    ------
    UserError
        If the file is missing or damaged, or its fingerprint or shape is another.
    """
    with scene_file.open_checked(path, KIND, VERSION, fingerprint) as file:
        size = file["rgb"].shape[1] if "rgb" in file and file["rgb"].ndim == 4 else 0
        shapes = {"rgb": (states, size, size, 3), "depth": (states, size, size)}
        scene_file.check_shapes(file, path, shapes)
        return Views(_mapped(file["rgb"], path), _mapped(file["depth"], path))


def _mapped(dataset: h5py.Dataset, path: Path) -> np.memmap:
    return np.memmap(path, dataset.dtype, "r", dataset.id.get_offset(), dataset.shape)
