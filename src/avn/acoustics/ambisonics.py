"""Third-order ambisonics: real spherical harmonics and their rotation about the vertical.

Channels are in ACN order (channel l*l + l + m) with SN3D weights and without the Condon-Shortley
phase, as in the AmbiX format. The ambisonic axes are x to the front, y to the left and z up.
In the world frame of an apartment the front is north: x = +y of the world, y = -x of the world.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

ORDER = 3
CHANNELS = (ORDER + 1) ** 2

# Degree m of every ACN channel: 0, -1, 0, 1, -2, ...
DEGREES: NDArray[np.int64] = np.concatenate(
    [np.arange(-order, order + 1) for order in range(ORDER + 1)]
)

_QUARTER_TURN_COSINES = (1.0, 0.0, -1.0, 0.0)


def sh(directions: ArrayLike) -> NDArray[np.float64]:
    """Compute the real spherical harmonics of directions, in the frame of a head facing north.

    Parameters
    ----------
    directions : array, shape (..., 3)
        Unit vectors from the receiver to the sound, in world axes (x east, y north, z up).

    Returns
    -------
    array, shape (..., 16)
        Third order, ACN, SN3D. Channel 0 is 1, channels 1 to 3 are the unit vector itself
        (west, up, north).

    Notes
    -----
    The polynomials are those of Nachbar et al., "AmbiX - a suggested ambisonics format" (2011).
    """
    vectors = np.asarray(directions, dtype=np.float64)
    x, y, z = vectors[..., 1], -vectors[..., 0], vectors[..., 2]
    channels = [
        np.ones_like(x),
        y,
        z,
        x,
        np.sqrt(3) * x * y,
        np.sqrt(3) * y * z,
        0.5 * (3 * z * z - 1),
        np.sqrt(3) * x * z,
        np.sqrt(0.75) * (x * x - y * y),
        np.sqrt(0.625) * y * (3 * x * x - y * y),
        np.sqrt(15) * x * y * z,
        np.sqrt(0.375) * y * (5 * z * z - 1),
        0.5 * z * (5 * z * z - 3),
        np.sqrt(0.375) * x * (5 * z * z - 1),
        np.sqrt(3.75) * z * (x * x - y * y),
        np.sqrt(0.625) * x * (x * x - 3 * y * y),
    ]
    return np.stack(channels, axis=-1)


def rotation_to_heading(heading: int) -> NDArray[np.float64]:
    """Return the matrix that rotates channels from the world frame to an agent's heading.

    Parameters
    ----------
    heading : int
        0 north, 1 east, 2 south, 3 west (clockwise).

    Returns
    -------
    array, shape (16, 16)
        ``sh_of_agent = matrix @ sh_of_world``. A clockwise turn of the agent increases the azimuth
        of every sound by the same angle (azimuths count to the left), so channels of degrees m and
        -m mix by the cosine and sine of m times the angle. For quarter turns all entries are
        exactly 0, 1 or -1.
    """
    matrix = np.zeros((CHANNELS, CHANNELS))
    for channel, degree in enumerate(DEGREES):
        quarters = int(abs(degree)) * heading
        cosine = _QUARTER_TURN_COSINES[quarters % 4]
        sine = _QUARTER_TURN_COSINES[(quarters - 1) % 4]
        opposite = channel - 2 * degree
        matrix[channel, channel] = cosine
        if degree > 0:  # cos(m (a + turn)) = cos(m a) cos(m turn) - sin(m a) sin(m turn)
            matrix[channel, opposite] = -sine
        elif degree < 0:  # sin(m (a + turn)) = sin(m a) cos(m turn) + cos(m a) sin(m turn)
            matrix[channel, opposite] = sine
    return matrix
