"""Heads that an agent can listen with: those of the package, and measured ones in SOFA files."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from avn.acoustics import sh_fit
from avn.acoustics.hrtf import ShHrirs, load_sh_hrirs
from avn.acoustics.sofa import SUFFIX, read_sofa
from avn.core.errors import UserError
from avn.core.hashing import file_hash

DEFAULT = "ku100"
_ASSETS = Path(__file__).parents[1] / "assets" / "hrirs"
# Heads of the package whose measurements it holds.
_MEASURED = {"kemar": _ASSETS / "mit_kemar_normal_pinna.sofa"}
NAMES = (DEFAULT, *_MEASURED)


def load_head(head: str = DEFAULT, key: str = "acoustics.head") -> ShHrirs:
    """Load the SH-HRIRs of a head.

    Parameters
    ----------
    head : str
        `ku100`, `kemar` or the path of a SOFA file.
    key : str
        Key of the setting, for messages.

    Returns
    -------
    ShHrirs
        Those of the package, or third-order ones fitted to the measurement; see
        `avn.acoustics.sh_fit`.

    Raises
    ------
    UserError
        If there is no such head, or its file cannot be used.
    """
    if head == DEFAULT:
        return load_sh_hrirs()
    path = _path(head, key)
    return _fitted(path, file_hash(path), key)


def head_content(head: str = DEFAULT, key: str = "acoustics.head") -> bytes:
    """Return the content of a head for fingerprints: the same file is the same head.

    Raises
    ------
    UserError
        If there is no such head.
    """
    if head == DEFAULT:  # as it was when there was no other head, so that products are found
        return load_sh_hrirs().ears[0].tobytes()
    return f"{file_hash(_path(head, key))} fit {sh_fit.VERSION}".encode()


def head_filters(
    rate: int, head: str = DEFAULT, key: str = "acoustics.head"
) -> NDArray[np.float32]:
    """Return the binaural filters of a head, (4, 2, 16, taps), cached.

    Parameters
    ----------
    rate : int
        Sampling rate of the filters, Hz.
    head, key : str
        See `load_head`.

    Raises
    ------
    UserError
        If there is no such head, or its file cannot be used.
    """
    return _filters(rate, head, head_content(head, key), key)


@lru_cache(maxsize=8)
def _filters(rate: int, head: str, content: bytes, key: str) -> NDArray[np.float32]:
    return load_head(head, key).filters(rate)


@lru_cache(maxsize=8)
def _fitted(path: Path, content: str, key: str) -> ShHrirs:
    return sh_fit.fit_sh_hrirs(read_sofa(path, key), f"{key}: {path}")


def _path(head: str, key: str) -> Path:
    """Return the path of the file of a head that is measured."""
    if head in _MEASURED:
        return _MEASURED[head]
    path = Path(head).expanduser()
    if path.suffix != SUFFIX:
        raise UserError(
            f"{key}: '{head}' is none of {', '.join(NAMES)}, nor the path of a file *{SUFFIX}"
        )
    if not path.is_file():
        raise UserError(f"{key}: {head}: no such file; give {', '.join(NAMES)} or a SOFA file")
    return path
