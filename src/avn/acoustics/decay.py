"""Energy decay: backward integration and reverberation times."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def schroeder(energy: ArrayLike, axis: int = -1) -> NDArray[np.float64]:
    """Compute the energy decay curve in dB, 0 at the start, by backward integration.

    M. R. Schroeder, "New method of measuring reverberation time", JASA 37, 1965.

    Parameters
    ----------
    energy : array
        Energy over time: squared samples, or a histogram.
    axis : int
        The axis of time.
    """
    to_come = np.flip(np.cumsum(np.flip(np.asarray(energy, np.float64), axis), axis), axis)
    total = to_come.take([0], axis)
    with np.errstate(divide="ignore"):
        curve: NDArray[np.float64] = 10 * np.log10(to_come / total)
    return curve


def reverberation_time(
    energy: ArrayLike, step: float, start: float = -5.0, stop: float = -35.0
) -> float:
    """Estimate the reverberation time (decay by 60 dB) by a line fit to the decay curve.

    Parameters
    ----------
    energy : array, shape (n,)
        Energy over time.
    step : float
        Seconds from one entry to the next.
    start, stop : float
        Part of the curve to fit, in dB (ISO 3382-2: -5 to -25 is T20, -5 to -35 is T30).

    Returns
    -------
    float
        Seconds; NaN where the curve does not reach `stop`.
    """
    curve = schroeder(energy)
    used = np.flatnonzero((curve <= start) & (curve >= stop))
    if len(used) < 3 or not np.isfinite(curve[used]).all() or curve[np.isfinite(curve)][-1] > stop:
        return float("nan")
    slope = np.polyfit(used * step, curve[used], 1)[0]
    return float(-60.0 / slope)
