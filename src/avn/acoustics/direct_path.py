"""The first sound to arrive, added exactly to what the rays bring.

Two regimes decide what a wall does to it:

- ``transmission``: it comes straight from the source, whatever stands between, at 1/r.
- ``diffraction``: where a wall stands between, it takes the shortest way round the corners and
  comes from the last of them, weakened in each band by the screen formula of Maekawa (Applied
  Acoustics 1, 1968) as fitted by 10 log10(3 + 20 N) dB, N = 2 x detour / wavelength, with the
  detour of the whole way. Furniture lets it pass in both regimes.

The amplitude of an unweakened arrival is 1 / (sqrt(4 pi) D). It starts on a whole sample, so that
the fraction of a sample does not colour it: the magnitude of its spectrum knows no time of flight.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from avn.acoustics.ambisonics import sh
from avn.acoustics.band_filters import minimum_phase
from avn.acoustics.corners import Paths, diffracted_paths, straight_paths
from avn.acoustics.materials import BANDS, SPEED_OF_SOUND
from avn.acoustics.rendering import to_int16
from avn.core.errors import UserError

LOSS_SECONDS = 0.008
REGIMES = ("transmission", "diffraction")


@dataclass(frozen=True)
class DirectPaths:
    """What each of L listeners hears first, at the ears of the four headings.

    Attributes
    ----------
    samples : (L, 4, 2, F) int16
        Heading, ear (0 left, 1 right), sample; x `scale` is the response.
    scale : (L,) float32
        0 where no sound arrives.
    onset : (L,) int32
        The sample of the impulse response where these samples begin.
    """

    samples: NDArray[np.int16]
    scale: NDArray[np.float32]
    onset: NDArray[np.int32]


def find_paths(
    regime: str,
    walls: NDArray[np.float64],
    source: NDArray[np.float64],
    listeners: NDArray[np.float64],
) -> Paths:
    """The ways of the first arrivals in a regime; raises `UserError` for an unknown one."""
    if regime == "transmission":
        return straight_paths(source, listeners)
    if regime == "diffraction":
        return diffracted_paths(walls, source, listeners)
    raise UserError(f"acoustics.direct_path: '{regime}' is not known; use {' or '.join(REGIMES)}")


def screen_loss(detour: NDArray[np.float64]) -> NDArray[np.float64]:
    """Loss in dB of sound that is bent round a screen, shape (..., 6), for detours in metres."""
    wavelengths = SPEED_OF_SOUND / np.array(BANDS, dtype=np.float64)
    loss: NDArray[np.float64] = 10 * np.log10(3 + 20 * 2 * detour[..., None] / wavelengths)
    return loss


def band_energies(paths: Paths) -> NDArray[np.float64]:
    """Energy per square metre of the arrivals in each band, shape (L, 6)."""
    loss = np.where(paths.bent[:, None], screen_loss(paths.detour), 0.0)
    spread = 4 * np.pi * paths.length[:, None] ** 2
    reached = np.isfinite(paths.length)[:, None]
    return np.where(reached, 10 ** (-np.where(reached, loss, 0.0) / 10) / spread, 0.0)


def render_paths(
    paths: Paths, filters: NDArray[np.float32], rate: int, loss_taps: int
) -> DirectPaths:
    """Render ways to the ears.

    Parameters
    ----------
    paths : Paths
    filters : array, shape (4, 2, 16, taps)
        Of `avn.acoustics.hrtf`.
    rate : int
        Sampling rate in Hz.
    loss_taps : int
        Length of the filters of bent ways; 1 where all ways are straight.
    """
    people = len(paths.length)
    reached = np.isfinite(paths.length)
    arrival = np.where(reached[:, None], paths.arrival, [0.0, 1.0, 0.0])
    ears = np.einsum("hect,lc->lhet", filters.astype(np.float64), sh(arrival))
    energies = band_energies(paths)
    loss = np.zeros((people, loss_taps))
    loss[:, 0] = np.sqrt(energies[:, -1])  # what nothing weakens has a single tap
    weakened = paths.bent & reached
    if weakened.any():
        loss[weakened] = minimum_phase(np.sqrt(energies[weakened]), rate, loss_taps)
    taps = ears.shape[-1] + loss_taps - 1
    if loss_taps == 1:
        ears *= loss[:, None, None]
    else:
        size = fft.next_fast_len(taps, real=True)
        spectra = fft.rfft(ears, size) * fft.rfft(loss, size)[:, None, None]
        ears = fft.irfft(spectra, size)[..., :taps]
    samples, scale = to_int16(ears)
    ways = np.where(reached, paths.length, 0.0)
    onset = np.rint(ways * (rate / SPEED_OF_SOUND)).astype(np.int32)
    return DirectPaths(samples, scale, onset)
