"""Features of an apartment's views as `features-<backbone>.h5` in its scene folder holds them."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from avn.core.errors import UserError
from avn.dataset import scene_file

# Raised when the layout of the file changes.
VERSION = 1


def features_kind(backbone: str, look: int = 0) -> str:
    """What a file of features says it holds; its name too."""
    return f"features-{backbone}" + (f"-look{look}" if look else "")


def features_file(folder: Path, backbone: str, look: int = 0) -> Path:
    """The file of the features by a backbone of the views in one of an apartment's looks."""
    return folder / f"{features_kind(backbone, look)}.h5"


def write_features(
    folder: Path,
    backbone: str,
    features: NDArray[np.float32],
    made_from: str,
    views_made_from: str,
    look: int = 0,
) -> None:
    """Store the features of an apartment's views.

    Parameters
    ----------
    folder : Path
        The scene folder.
    backbone : str
        Name of what saw the views.
    features : (S, D) float32
        Of the S states, 4 x cell + heading; each of length 1.
    made_from : str
        Hash of everything they depend on, the views included.
    views_made_from : str
        The hash that the views carry.
    look : int
    """
    path = features_file(folder, backbone, look)

    def fill(file: h5py.File) -> None:
        file["features"] = features.astype(np.float32, copy=False)
        file.attrs["views_made_from"] = views_made_from

    scene_file.write(path, features_kind(backbone, look), VERSION, made_from, fill)


def read_features(
    folder: Path,
    backbone: str,
    states: int,
    made_from: str | None = None,
    views_made_from: str | None = None,
    look: int = 0,
) -> NDArray[np.float32]:
    """The features of an apartment's views.

    Parameters
    ----------
    folder : Path
        The scene folder.
    backbone : str
    states : int
        How many there must be.
    made_from, views_made_from : str, optional
        The hashes that they must carry.
    look : int

    Returns
    -------
    (S, D) float32

    Raises
    ------
    UserError
        Where the file is missing, damaged, of another backbone, other views or another shape.
    """
    path, kind = features_file(folder, backbone, look), features_kind(backbone, look)
    with scene_file.open_checked(path, kind, VERSION, made_from) as file:
        ndim = file["features"].ndim if "features" in file else 0
        width = file["features"].shape[-1] if ndim == 2 else 0
        scene_file.check_shapes(file, path, {"features": (states, width)})
        if views_made_from is not None and file.attrs.get("views_made_from") != views_made_from:
            raise UserError(
                f"{path}: features of other views than those that lie beside it; delete it and "
                "run the command again to make it anew"
            )
        found: NDArray[np.float32] = file["features"][()]
    return found
