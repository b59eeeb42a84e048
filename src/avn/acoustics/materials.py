"""Absorption and scattering of materials, and absorption of air, in six octave bands.

Absorption is the random-incidence coefficient of published tables:

[V] M. Vorlaender, *Auralization*, Springer 2008, annex (tables of absorption and scattering).
[E] M. D. Egan, *Architectural Acoustics*, McGraw-Hill 1988, table of absorption data.
[C] T. Cox and P. D'Antonio, *Acoustic Absorbers and Diffusers*, appendix A.
[N] EN 12354-6:2003: a hard object in a room (a cabinet, a table, a stove), with its content and
    the gaps around it, has an equivalent absorption area of V^(2/3) square metres. Over the exposed
    faces of common pieces that is about a quarter: wardrobe 0.23, dresser 0.25, counter 0.30,
    fridge 0.21. With the tables' values for plain panels, furniture would hardly absorb.

Scattering of tables and seats is that of [V]; for building surfaces and single pieces the
coefficient at mid frequency of

[Z] X. Zeng, C. L. Christensen, J. H. Rindel, "Practical methods to define scattering coefficients
    in a room acoustics computer model", *Applied Acoustics* 67, 2006,

is extended to the bands, proportional to the square root of frequency through 707 Hz. Walls of
inhabited rooms carry pictures, lamps and switches that a floor plan leaves out, so they have the
upper end of [Z] for plain walls (0.1).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avn.apartments.floor_plan import MATERIALS
from avn.core.errors import UserError

BANDS = (125, 250, 500, 1000, 2000, 4000)
SPEED_OF_SOUND = 343.0  # m/s, at 20 degrees

_MID_FREQUENCY = 707.0  # Hz, of the coefficients of [Z]


@dataclass(frozen=True)
class Material:
    """Coefficients of a material and where they come from.

    Attributes
    ----------
    absorption : tuple of 6 float
        Random-incidence absorption coefficient in each of `BANDS`.
    roughness : float or tuple of 6 float
        Scattering coefficient at mid frequency, or in each band.
    absorption_source, scattering_source : str
        Reference in brackets, see above, and the row of its table. A material that no table lists
        has the row of the most similar one.
    estimated : bool
        True where the absorption is an estimate for furniture of this material, from its volume
        and faces, and not a measured coefficient.
    """

    absorption: tuple[float, ...]
    roughness: float | tuple[float, ...]
    absorption_source: str
    scattering_source: str
    estimated: bool = False

    @property
    def scattering(self) -> tuple[float, ...]:
        """Scattering coefficient in each band, at most 0.99."""
        if isinstance(self.roughness, tuple):
            return self.roughness
        return tuple(min(0.99, self.roughness * (f / _MID_FREQUENCY) ** 0.5) for f in BANDS)


_OBJECTS = "[N] hard objects"
_SMOOTH = "[Z] smooth surfaces, 0.02 to 0.05"
_PLAIN = "[Z] plain walls with small things on them"
_PIECES = "[Z] shelf with books, as the most similar"

TABLE: dict[str, Material] = {
    "parquet": Material(
        (0.15, 0.11, 0.10, 0.07, 0.06, 0.07), 0.05, "[E] wood floor on joists", _SMOOTH
    ),
    "carpet": Material(
        (0.08, 0.24, 0.57, 0.69, 0.71, 0.73), 0.10, "[E] heavy carpet on foam", "[Z], an estimate"
    ),
    "floor_tiles": Material(
        (0.01, 0.01, 0.01, 0.02, 0.02, 0.02), 0.05, "[V] ceramic tiles, smooth", _SMOOTH
    ),
    "plaster": Material(
        (0.15, 0.10, 0.06, 0.04, 0.04, 0.05), 0.10, "[V] plasterboard on frame, painted", _PLAIN
    ),
    "painted_brick": Material(
        (0.01, 0.01, 0.02, 0.02, 0.02, 0.03), 0.10, "[E] brick, unglazed, painted",
        "[Z] brickwork, filled joints, 0.05 to 0.1",
    ),
    "wall_tiles": Material(
        (0.01, 0.01, 0.01, 0.02, 0.02, 0.02), 0.10, "[V] ceramic tiles, smooth", _PLAIN
    ),
    "ceiling_plaster": Material(
        (0.20, 0.15, 0.10, 0.08, 0.04, 0.02), 0.05, "[V] plasterboard ceiling", _SMOOTH
    ),
    "glass": Material(
        (0.10, 0.05, 0.04, 0.03, 0.03, 0.03), 0.05, "[V] glass window", _SMOOTH
    ),
    "wood": Material(
        (0.27, 0.25, 0.25, 0.25, 0.25, 0.25), (0.20, 0.30, 0.40, 0.50, 0.50, 0.60),
        "[N] hard objects, thin panels", "[V] tables of a classroom", estimated=True,
    ),
    "upholstery": Material(
        (0.44, 0.60, 0.77, 0.89, 0.82, 0.70), (0.30, 0.50, 0.60, 0.60, 0.70, 0.70),
        "[V] seats upholstered in cloth", "[V] theatre seats",
    ),
    "mattress": Material(
        (0.70, 0.76, 0.81, 0.84, 0.84, 0.81), 0.30, "[V] heavily upholstered seats", _PIECES
    ),
    "laminate": Material((0.25,) * 6, 0.30, _OBJECTS, _PIECES, estimated=True),
    "ceramic": Material((0.25,) * 6, 0.30, _OBJECTS, _PIECES, estimated=True),
    "metal": Material((0.25,) * 6, 0.30, _OBJECTS, _PIECES, estimated=True),
    "books": Material(
        (0.36, 0.44, 0.31, 0.29, 0.39, 0.25), 0.30,
        "[E] coarse concrete block: hard, porous, broken up", "[Z] shelf with books",
    ),
    "fabric": Material(
        (0.07, 0.31, 0.49, 0.75, 0.70, 0.60), 0.30, "[C] medium velour draped to half area", _PIECES
    ),
}  # fmt: skip

NAMES = MATERIALS


def _rows(names: Iterable[str], kind: str) -> NDArray[np.float64]:
    rows = []
    for name in names:
        if name not in TABLE:
            raise UserError(f"material '{name}' is not known; use one of {', '.join(NAMES)}")
        rows.append(getattr(TABLE[name], kind))
    return np.array(rows, dtype=np.float64).reshape(-1, len(BANDS))


def absorption(names: Iterable[str]) -> NDArray[np.float64]:
    """Return the absorption coefficients of materials.

    Parameters
    ----------
    names : iterable of str
        M names out of `NAMES`.

    Returns
    -------
    array, shape (M, 6)
        Random-incidence absorption coefficients in the octave bands `BANDS`.

    Raises
    ------
    UserError
        If a name is unknown.
    """
    return _rows(names, "absorption")


def scattering(names: Iterable[str]) -> NDArray[np.float64]:
    """Return the scattering coefficients of materials, shape (M, 6).

    The coefficient is the share of the reflected energy that is not reflected specularly.
    Parameters and errors are those of `absorption`.
    """
    return _rows(names, "scattering")


def air_attenuation(
    frequencies: ArrayLike = BANDS, celsius: float = 20.0, humidity: float = 50.0
) -> NDArray[np.float64]:
    """Compute the attenuation of energy by air, the m of exp(-m x distance).

    Parameters
    ----------
    frequencies : array
        In Hz.
    celsius, humidity : float
        Temperature, and relative humidity in per cent; pressure is one atmosphere.

    Returns
    -------
    array
        m in 1/metre, of the shape of `frequencies`.

    Notes
    -----
    ISO 9613-1:1993, equations (3) to (5) and annex B.
    """
    squares = np.asarray(frequencies, dtype=np.float64) ** 2
    kelvin = celsius + 273.15
    warm = kelvin / 293.15
    vapour = humidity * 10 ** (-6.8346 * (273.16 / kelvin) ** 1.261 + 4.6151)
    oxygen = 24 + 4.04e4 * vapour * (0.02 + vapour) / (0.391 + vapour)
    nitrogen = warm**-0.5 * (9 + 280 * vapour * np.exp(-4.170 * (warm ** (-1 / 3) - 1)))
    relaxation = warm**-2.5 * (
        0.01275 * np.exp(-2239.1 / kelvin) * oxygen / (oxygen**2 + squares)
        + 0.1068 * np.exp(-3352.0 / kelvin) * nitrogen / (nitrogen**2 + squares)
    )
    decibel_per_metre = 8.686 * squares * (1.84e-11 * warm**0.5 + relaxation)
    result: NDArray[np.float64] = decibel_per_metre * np.log(10) / 10
    return result
