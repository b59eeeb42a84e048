"""Straight lines among surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from avn.apartments.surfaces import Surfaces

# Parameters of a line so close to its ends count as the ends themselves.
_ENDS = 1e-9


@numba.njit(cache=True)
def _clear(
    axis: NDArray[np.int8],
    offset: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    origins: NDArray[np.float64],
    targets: NDArray[np.float64],
) -> NDArray[np.bool_]:
    clear = np.ones(len(origins), dtype=np.bool_)
    for n in range(len(origins)):
        for q in range(len(axis)):
            a = axis[q]
            way = targets[n, a] - origins[n, a]
            if way == 0.0:
                continue
            t = (offset[q] - origins[n, a]) / way
            if t <= _ENDS or t >= 1.0 - _ENDS:
                continue
            b = 1 if a == 0 else 0
            c = 1 if a == 2 else 2
            u = origins[n, b] + t * (targets[n, b] - origins[n, b])
            v = origins[n, c] + t * (targets[n, c] - origins[n, c])
            if lower[q, 0] <= u <= upper[q, 0] and lower[q, 1] <= v <= upper[q, 1]:
                clear[n] = False
                break
    return clear


def line_of_sight(
    surfaces: Surfaces, origins: NDArray[np.float64], targets: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether the straight line between two points meets no surface.

    Parameters
    ----------
    surfaces : Surfaces
    origins, targets : (N, 3) float64
        Points x, y, z in metres. A surface that touches the line at one of its two ends alone
        does not count.

    Returns
    -------
    (N,) bool
    """
    return np.asarray(
        _clear(
            surfaces.axis,
            surfaces.offset,
            surfaces.lower,
            surfaces.upper,
            np.ascontiguousarray(origins, dtype=np.float64),
            np.ascontiguousarray(targets, dtype=np.float64),
        )
    )
