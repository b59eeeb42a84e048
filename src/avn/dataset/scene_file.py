"""Container of the scene files: HDF5 with a header for integrity checks.

The first 512 bytes (the user block of HDF5) hold the length and the CRC-32 of all that follows, so
that truncated and corrupted files are detected; any HDF5 tool reads the rest.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import h5py

from avn.core.errors import UserError
from avn.core.files import atomic_write

_BLOCK = 512
_CHUNK = 1 << 24
_HEADER = re.compile(rb"AVN scene file, (\d+) bytes with CRC-32 ([0-9a-f]{8}) follow\n\0*")
_MEND = "delete it and run the command again to make it anew"


def write(
    path: Path, kind: str, version: int, made_from: str, fill: Callable[[h5py.File], None]
) -> None:
    """Write a scene file under a temporary name and rename it when it is whole.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        Kind of the content, such as `geometry`.
    version : int
        Version of the format of that kind.
    made_from : str
        Fingerprint: hash of all that the content depends on.
    fill : callable
        Function that writes the datasets into the open file.
    """
    with atomic_write(path) as part:
        with h5py.File(part, "w", userblock_size=_BLOCK, libver="v110") as file:
            file.attrs["kind"] = kind
            file.attrs["version"] = version
            file.attrs["made_from"] = made_from
            fill(file)
        size, crc = _measure(part)
        header = f"AVN scene file, {size} bytes with CRC-32 {crc:08x} follow\n".encode()
        with part.open("r+b") as raw:
            raw.write(header.ljust(_BLOCK, b"\0"))


def open_checked(path: Path, kind: str, version: int, made_from: str | None = None) -> h5py.File:
    """Check a scene file and open it for reading.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        Expected kind of the content.
    version : int
        Expected version of the format.
    made_from : str, optional
        Expected fingerprint; None accepts any.

    Raises
    ------
    UserError
        If the file is missing, truncated or corrupted, or its kind, version or fingerprint is
        another.
    """
    if not path.is_file():
        raise UserError(f"{path}: no such scene file; run `python -m avn.generate` to make it")
    try:
        with ExitStack() as opened:
            file = opened.enter_context(h5py.File(path, "r"))
            _check(dict(file.attrs), path, kind, version, made_from)
            opened.pop_all()  # the checks passed: the caller closes the file
            return file
    except (OSError, KeyError, RuntimeError, ValueError) as error:  # h5py's errors for damage
        raise UserError(f"{path}: {_damage(path) or 'not an HDF5 file'}; {_MEND}") from error


def check_shapes(file: h5py.File, path: Path, shapes: dict[str, tuple[int, ...]]) -> None:
    """Raise `UserError` if a dataset is missing or has another shape than expected.

    Parameters
    ----------
    file : h5py.File
        The open file.
    path : Path
        Its path, for messages.
    shapes : dict
        Name of each dataset to its expected shape.
    """
    for name, shape in shapes.items():
        if name not in file or file[name].shape != shape:
            actual = file[name].shape if name in file else "missing"
            raise UserError(f"{path}: '{name}' is {actual}, not {shape}; make the scene again")


def _check(
    marks: dict[str, Any], path: Path, kind: str, version: int, made_from: str | None
) -> None:
    if marks.get("kind") != kind:
        raise UserError(f"{path}: holds '{marks.get('kind')}', not '{kind}'; {_MEND}")
    if marks.get("version") != version:
        raise UserError(
            f"{path}: format version {marks.get('version')}, but this avn reads version "
            f"{version}; {_MEND}"
        )
    if damage := _damage(path):
        raise UserError(f"{path}: {damage}; {_MEND}")
    if made_from is not None and marks.get("made_from") != made_from:
        raise UserError(f"{path}: made from another floor plan or other settings; {_MEND}")


def _damage(path: Path) -> str | None:
    header = _header(path)
    if header is None:
        return "not a scene file, or its header is damaged"
    size, crc = header
    actual = path.stat().st_size - _BLOCK
    if actual < size:
        return f"cut short ({actual} of {size} bytes)"
    if actual != size or _measure(path) != header:
        return f"changed since it was written (CRC-32 is not {crc:08x})"
    return None


def _header(path: Path) -> tuple[int, int] | None:
    with path.open("rb") as raw:
        match = _HEADER.fullmatch(raw.read(_BLOCK))
    return (int(match[1]), int(match[2], 16)) if match else None


def _measure(path: Path) -> tuple[int, int]:
    size = crc = 0
    with path.open("rb") as raw:
        raw.seek(_BLOCK)
        while chunk := raw.read(_CHUNK):
            size += len(chunk)
            crc = zlib.crc32(chunk, crc)
    return size, crc
