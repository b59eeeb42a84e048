"""Direct path from a source to receivers, computed exactly and added to the traced reflections.

Two regimes set the effect of walls:

- ``transmission``: the direct path is the straight line, through all walls, and decays with 1/r.
- ``diffraction``: where a wall blocks the straight line, the direct path is the shortest path round
  the corners and arrives from the last of them. It is attenuated in each band by the screen formula
  of Maekawa (Applied Acoustics 1, 1968) as fitted by 10 log10(3 + 20 N) dB,
  N = 2 x detour / wavelength, with the detour of the whole path.

Furniture is transparent in both regimes. The amplitude without attenuation is 1 / (sqrt(4 pi) D).
Air takes the same part of the energy in each band as of a reflection, exp(-m D) over the length D
of the path. The onset is rounded to a whole sample, so that no fractional delay colours the
spectrum.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from avn.acoustics.ambisonics import sh
from avn.acoustics.band_filters import minimum_phase
from avn.acoustics.corners import Paths, diffracted_paths, straight_paths
from avn.acoustics.materials import BANDS, SPEED_OF_SOUND, air_attenuation
from avn.acoustics.rendering import to_int16
from avn.core.errors import UserError

LOSS_SECONDS = 0.008  # length of the filters that attenuate the bands
REGIMES = ("transmission", "diffraction")


@dataclass(frozen=True)
class DirectPaths:
    """Binaural responses of the direct paths to L receivers, for the four headings.

    Attributes
    ----------
    samples : (L, 4, 2, F) int16
        Heading, ear (0 left, 1 right), sample; `samples * scale` is the response.
    scale : (L,) float32
        0 where there is no path.
    onset : (L,) int32
        Index of the first of these samples in the impulse response.
    """

    samples: NDArray[np.int16]
    scale: NDArray[np.float32]
    onset: NDArray[np.int32]


def find_paths(
    regime: str,
    walls: NDArray[np.float64],
    source: NDArray[np.float64],
    receivers: NDArray[np.float64],
) -> Paths:
    """Find the direct paths of one source in a regime.

    Parameters
    ----------
    regime : {"transmission", "diffraction"}
        Effect of walls.
    walls : array, shape (W, 4)
        Solid blocks x0, y0, x1, y1 in plan, metres; used in `diffraction`.
    source : array, shape (3,)
        Position, metres.
    receivers : array, shape (L, 3)
        Positions, metres.

    Raises
    ------
    UserError
        If the regime is unknown.
    """
    if regime == "transmission":
        return straight_paths(source, receivers)
    if regime == "diffraction":
        return diffracted_paths(walls, source, receivers)
    raise UserError(f"acoustics.direct_path: '{regime}' is not known; use {' or '.join(REGIMES)}")


def screen_loss(detour: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compute the loss in dB of diffraction at a screen, shape (..., 6), for detours in metres."""
    wavelengths = SPEED_OF_SOUND / np.array(BANDS, dtype=np.float64)
    loss: NDArray[np.float64] = 10 * np.log10(3 + 20 * 2 * detour[..., None] / wavelengths)
    return loss


def band_energies(paths: Paths, air: bool = True) -> NDArray[np.float64]:
    """Compute the energy per square metre of the direct paths in each band, shape (L, 6).

    With `air`, air absorbs energy over the length of the paths.
    """
    reached = np.isfinite(paths.length)[:, None]
    length = np.where(reached, paths.length[:, None], 1.0)
    screened = np.where(reached & paths.bent[:, None], screen_loss(paths.detour), 0.0)
    energy = 10 ** (-screened / 10) / (4 * np.pi * length**2)
    if air:
        energy *= np.exp(-air_attenuation() * length)
    return np.where(reached, energy, 0.0)


def render_paths(
    paths: Paths, filters: NDArray[np.float32], rate: int, loss_taps: int, air: bool = True
) -> DirectPaths:
    """Render direct paths to binaural responses.

    Parameters
    ----------
    paths : Paths
        Direct paths of one source.
    filters : array, shape (4, 2, 16, taps)
        Filters of `avn.acoustics.hrtf.ShHrirs.filters`.
    rate : int
        Sampling rate in Hz.
    loss_taps : int
        Length of the filters that attenuate the bands; 1 where nothing does so, that is where all
        paths are straight and there is no absorption by air.
    air : bool
        True for absorption by air.
    """
    receiver_count = len(paths.length)
    reached = np.isfinite(paths.length)
    arrival = np.where(reached[:, None], paths.arrival, [0.0, 1.0, 0.0])
    ears = np.einsum("hect,lc->lhet", filters.astype(np.float64), sh(arrival))
    energies = band_energies(paths, air)
    loss = np.zeros((receiver_count, loss_taps))
    loss[:, 0] = np.sqrt(energies[:, -1])  # a path without attenuation has a single tap
    attenuated = (paths.bent | air) & reached
    if attenuated.any():
        loss[attenuated] = minimum_phase(np.sqrt(energies[attenuated]), rate, loss_taps)
    taps = ears.shape[-1] + loss_taps - 1
    if loss_taps == 1:
        ears *= loss[:, None, None]
    else:
        size = fft.next_fast_len(taps, real=True)
        spectra = fft.rfft(ears, size) * fft.rfft(loss, size)[:, None, None]
        ears = fft.irfft(spectra, size)[..., :taps]
    samples, scale = to_int16(ears)
    lengths = np.where(reached, paths.length, 0.0)
    onset = np.rint(lengths * (rate / SPEED_OF_SOUND)).astype(np.int32)
    return DirectPaths(samples, scale, onset)
