"""Head-related impulse responses as filters of third-order ambisonic channels.

The set of the package's default head is that of Omnitone 1.3.0 (Apache-2.0), made from the SADIE
measurements of a KU 100 dummy head; credit and licence are beside it in ``assets/hrirs``. That head
is assumed symmetric: the file holds the left ear, and the right ear is its mirror image.
`avn.acoustics.heads` has the other heads.
"""

from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from math import gcd

import numpy as np
import soundfile
from numpy.typing import NDArray

from avn.acoustics.ambisonics import CHANNELS, DEGREES, rotation_to_heading, sh

HEADINGS = 4

# Sampling rate at which the level of the filters is set for all rates, Hz.
LEVEL_RATE = 16000


@dataclass(frozen=True)
class ShHrirs:
    """Spherical-harmonic HRIRs of both ears.

    Attributes
    ----------
    ears : array, shape (2, 16, taps)
        Impulse responses of the left and the right ear, to be convolved with the ambisonic channels
        (ACN, SN3D) in the frame of the head and summed. Only `filters` sets their level.
    rate : int
        Sampling rate in Hz.
    """

    ears: NDArray[np.float64]
    rate: int

    def filters(self, rate: int = 16000) -> NDArray[np.float32]:
        """Compute the filters from ambisonic channels in the world frame to an agent's ears.

        Parameters
        ----------
        rate : int
            Sampling rate of the filters in Hz.

        Returns
        -------
        float32 array, shape (4, 2, 16, taps)
            Heading (0 north, 1 east, 2 south, 3 west), ear (0 left, 1 right), channel, tap.
            The sum over channels of ``filters[h, e] * response`` is the binaural response of an
            agent that faces h.

        Notes
        -----
        One constant, the same for every rate, scales all filters, so that a plane wave of unit
        amplitude from the front has unit energy at 16 kHz, averaged over the two ears: the mean
        of |H|^2 from 0 Hz to 8 kHz is 1. So a binaural response has the level of an
        omnidirectional microphone for sound from the front.
        """
        ears = self._resampled(rate)
        front = np.einsum("ect,c->et", self._resampled(LEVEL_RATE), sh([0.0, 1.0, 0.0]))
        ears /= np.sqrt((front**2).sum(axis=1).mean())
        turned = [
            np.einsum("edt,dc->ect", ears, rotation_to_heading(heading))
            for heading in range(HEADINGS)
        ]
        return np.stack(turned).astype(np.float32)

    def _resampled(self, rate: int) -> NDArray[np.float64]:
        """Resample the responses of the left and the right ear to a rate in Hz, (2, 16, taps)."""
        from scipy.signal import resample_poly

        common = gcd(rate, self.rate)
        up, down = rate // common, self.rate // common
        # `resample_poly` keeps the amplitude of an impulse response; to keep the spectrum, the
        # taps, `down / up` times fewer, are multiplied by that ratio.
        return np.asarray(resample_poly(self.ears, up, down, axis=2)) * (down / up)


def mirrored(left: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return both ears (2, 16, taps) of a symmetric head from its left ear, (16, taps)."""
    return np.stack([left, np.where(DEGREES[:, None] < 0, -left, left)])


@lru_cache(maxsize=1)
def load_sh_hrirs() -> ShHrirs:
    """Load the SH-HRIRs of the KU 100.

    Returns
    -------
    ShHrirs
        16 channels of 256 taps at 48 kHz.
    """
    asset = resources.files("avn") / "assets" / "hrirs" / "omnitone_third_order.wav"
    with resources.as_file(asset) as path:
        samples, rate = soundfile.read(path, dtype="float64", always_2d=True)
    if samples.shape[1] != CHANNELS:
        raise RuntimeError(f"the HRIR asset has {samples.shape[1]} channels, not {CHANNELS}")
    ears = mirrored(np.ascontiguousarray(samples.T))
    ears.setflags(write=False)
    return ShHrirs(ears=ears, rate=int(rate))
