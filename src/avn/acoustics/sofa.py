"""Measured head-related impulse responses from SOFA files (AES69, SimpleFreeFieldHRIR)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avn.core.errors import UserError

SUFFIX = ".sofa"
_CONVENTION = "SimpleFreeFieldHRIR"
_LOWEST_RATE = 8000


@dataclass(frozen=True)
class MeasuredHrirs:
    """Head-related impulse responses of M directions.

    Attributes
    ----------
    responses : array, shape (M, 2, taps)
        Measurement, ear (0 left, 1 right), sample.
    directions : array, shape (M, 3)
        Unit vectors to the source in the world's axes (x east, y north, z up), for a head that
        faces north.
    rate : int
        Sampling rate in Hz.
    """

    responses: NDArray[np.float64]
    directions: NDArray[np.float64]
    rate: int


def read_sofa(path: Path, key: str = "acoustics.head") -> MeasuredHrirs:
    """Read the HRIRs of a SOFA file.

    Parameters
    ----------
    path : Path
        The file, with the suffix `.sofa`.
    key : str
        Key of the setting that names the file, for messages.

    Returns
    -------
    MeasuredHrirs
        With the delays that the file states apart from its responses. The left ear is the receiver
        with the larger y, or the first one where the file does not tell.

    Raises
    ------
    UserError
        If the file is missing, is no SOFA file, is of another convention, does not have two
        receivers, or holds values that cannot be.
    """
    name = f"{key}: {path}"
    sofa = _opened(path, name)
    convention = str(sofa.GLOBAL_SOFAConventions)
    if convention != _CONVENTION:
        raise UserError(f"{name} is of the convention {convention}; give one of {_CONVENTION}")
    try:
        responses = np.asarray(sofa.Data_IR, dtype=np.float64)
        if responses.ndim < 2 or responses.shape[1] != 2:
            count = responses.shape[1] if responses.ndim > 1 else 1
            raise UserError(f"{name}: it has {count} receivers; give a file of two ears")
        responses = responses.reshape(*responses.shape[:2], -1)
        rate = _rate(sofa, name)
        responses = _delayed(responses, sofa.Data_Delay)[:, _ears(sofa)]
        directions = _directions(sofa, len(responses))
    except (AttributeError, TypeError, ValueError, IndexError):
        raise UserError(
            f"{name}: what {_CONVENTION} requires is missing or has a wrong shape; "
            "convert the file again"
        ) from None
    if not (np.isfinite(responses).all() and np.isfinite(directions).all()):
        raise UserError(f"{name}: a value is not finite, or a source is at the head's centre")
    if not responses.any(axis=(0, 2)).all():
        raise UserError(f"{name}: an ear is silent in all directions; give a file of two ears")
    return MeasuredHrirs(responses, directions, rate)


def _opened(path: Path, name: str) -> Any:
    import sofar  # it imports netCDF4, which takes longer than most of avn

    if not path.is_file():
        raise UserError(f"{name}: no such file; give the path of a SOFA file")
    try:
        # Many files violate details of the standard that do not matter here.
        return sofar.read_sofa(str(path), verify=False, verbose=False)
    except Exception:  # of several libraries, for files of all kinds
        raise UserError(
            f"{name}: not a SOFA file that can be read; give one of the convention {_CONVENTION}"
        ) from None


def _rate(sofa: Any, name: str) -> int:
    rates = np.unique(np.asarray(sofa.Data_SamplingRate, dtype=np.float64))
    if len(rates) != 1 or not rates[0] >= _LOWEST_RATE:
        found = " and ".join(f"{rate:g}" for rate in rates[:2])
        raise UserError(
            f"{name}: sampling rate {found} Hz; give one rate of {_LOWEST_RATE} or more"
        )
    return round(float(rates[0]))


def _delayed(responses: NDArray[np.float64], delay: Any) -> NDArray[np.float64]:
    """Delay responses by what a file states apart from them, in samples, (1 or M, 2)."""
    from scipy import fft

    delays = np.broadcast_to(np.reshape(delay, (-1, 2)), responses.shape[:2])
    if not delays.any():
        return responses
    delays = delays - delays.min()  # what all have in common tells nothing
    taps = responses.shape[-1] + int(np.ceil(delays.max())) + 1
    size = fft.next_fast_len(2 * taps, real=True)
    phase = -2j * np.pi * np.arange(size // 2 + 1) / size * delays[..., None]
    spectra = fft.rfft(responses, size) * np.exp(phase)
    delayed: NDArray[np.float64] = fft.irfft(spectra, size)[..., :taps]
    return delayed


def _cartesian(values: Any, kind: str, count: int = 1) -> NDArray[np.float64]:
    """Return positions (count, 3), spherical in degrees or Cartesian, as Cartesian ones."""
    points = np.asarray(values, dtype=np.float64).reshape(-1, 3)
    if kind.lower() == "spherical":
        azimuth, elevation = np.radians(points[:, :2]).T
        flat = np.cos(elevation)
        unit = (np.cos(azimuth) * flat, np.sin(azimuth) * flat, np.sin(elevation))
        points = np.stack(unit, axis=1) * points[:, 2:]
    elif kind.lower() != "cartesian":
        raise ValueError(kind)
    return np.broadcast_to(points, (max(count, len(points)), 3))


def _ears(sofa: Any) -> list[int]:
    """Return the indices of the left and the right receiver; y points to the left."""
    places = np.asarray(sofa.ReceiverPosition, dtype=np.float64)
    places = places.reshape(2, 3, -1)[..., 0]
    first, second = _cartesian(places, str(sofa.ReceiverPosition_Type))[:, 1]
    return [1, 0] if second - first > 1e-6 else [0, 1]


def _directions(sofa: Any, count: int) -> NDArray[np.float64]:
    """Return unit vectors to the sources (M, 3) in the world's axes, for a head facing north."""
    source = _cartesian(sofa.SourcePosition, str(sofa.SourcePosition_Type), count)
    listener = _cartesian(sofa.ListenerPosition, str(sofa.ListenerPosition_Type), count)
    kind = str(getattr(sofa, "ListenerView_Type", "cartesian"))
    view = _cartesian(getattr(sofa, "ListenerView", (1.0, 0.0, 0.0)), kind, count)
    up = _cartesian(getattr(sofa, "ListenerUp", (0.0, 0.0, 1.0)), kind, count)
    left = np.cross(up, view)
    axes = np.stack([-left, view, np.cross(view, left)], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        axes = axes / np.linalg.norm(axes, axis=2, keepdims=True)
        seen = np.einsum("mij,mj->mi", axes, source - listener)
        unit: NDArray[np.float64] = seen / np.linalg.norm(seen, axis=1, keepdims=True)
    if unit.shape != (count, 3):
        raise ValueError(unit.shape)
    return unit
