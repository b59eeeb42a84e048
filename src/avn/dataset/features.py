"""Embeddings of an apartment's views, in a file."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from avn.dataset import scene_file

KIND = "features"
# Raised when the layout of the file changes.
VERSION = 1


def write_features(path: Path, features: NDArray[np.float32], fingerprint: str) -> None:
    """Store the features of an apartment's views.

    Parameters
    ----------
    path : Path
    features : (S, D) float32
        Of the S states, 4 x cell + heading; each of length 1.
    fingerprint : str
        What tells them from others, the views included.
    """

    def fill(file: h5py.File) -> None:
        file["features"] = features.astype(np.float32, copy=False)

    scene_file.write(path, KIND, VERSION, fingerprint, fill)


def read_features(path: Path, states: int, fingerprint: str | None = None) -> NDArray[np.float32]:
    """The features of an apartment's views.

    Parameters
    ----------
    path : Path
    states : int
        How many there must be.
    fingerprint : str, optional
        The one that the file must carry.

    Returns
    -------
    (S, D) float32

    Raises
    ------
    UserError
        Where the file is missing, damaged, of another making or another shape.
    """
    with scene_file.open_checked(path, KIND, VERSION, fingerprint) as file:
        ndim = file["features"].ndim if "features" in file else 0
        width = file["features"].shape[-1] if ndim == 2 else 0
        scene_file.check_shapes(file, path, {"features": (states, width)})
        found: NDArray[np.float32] = file["features"][()]
    return found
