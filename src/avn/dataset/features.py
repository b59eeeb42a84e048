"""Files of the features (embeddings) of an apartment's views."""

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
    """Write the features of an apartment's views.

    Parameters
    ----------
    path : Path
        The file.
    features : (S, D) float32
        Unit vectors, one for each state 4 x cell + heading.
    fingerprint : str
        Hash of all that the features depend on, the views included.
    """

    def fill(file: h5py.File) -> None:
        file["features"] = features.astype(np.float32, copy=False)

    scene_file.write(path, KIND, VERSION, fingerprint, fill)


def read_features(path: Path, states: int, fingerprint: str | None = None) -> NDArray[np.float32]:
    """Read the features of an apartment's views.

    Parameters
    ----------
    path : Path
        The file.
    states : int
        Expected number of states S.
    fingerprint : str, optional
        Expected fingerprint; None accepts any.

    Returns
    -------
    (S, D) float32
        Unit vectors, one for each state.

    Raises
    ------
    UserError
        If the file is missing or damaged, or its fingerprint or shape is another.
    """
    with scene_file.open_checked(path, KIND, VERSION, fingerprint) as file:
        ndim = file["features"].ndim if "features" in file else 0
        width = file["features"].shape[-1] if ndim == 2 else 0
        scene_file.check_shapes(file, path, {"features": (states, width)})
        features: NDArray[np.float32] = file["features"][()]
    return features
