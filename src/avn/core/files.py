"""Names, locks and atomic writes of files under `outputs`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from avn.core.errors import UserError
from avn.core.progress import log

# Folders whose locks this process holds.
_held: set[Path] = set()


def stage_folder(outputs: str | Path, stage: str, what: str, made_from: str) -> Path:
    """Return the folder `<outputs>/<stage>/<what>-<hash>` of a stage.

    Parameters
    ----------
    outputs : str or Path
        Folder of all outputs.
    stage : str
        Name of the stage.
    what : str
        Name of the product.
    made_from : str
        Fingerprint, of which the first 8 digits are in the name.
    """
    return Path(outputs) / stage / f"{what}-{made_from[:8]}"


def check_name(option: str, name: str) -> None:
    """Raise `UserError` with the option for a name that is not valid as a folder's name."""
    if not name or name.startswith(".") or "/" in name or "\0" in name:
        raise UserError(f"{option}: '{name}' cannot name a folder; use letters, digits, - and _")


@contextmanager
def locked(folder: Path, what: str) -> Iterator[None]:
    """Hold the lock of a stage's folder; it is freed when the process ends, however it ends.

    The lock is reentrant, since one stage of a folder may need another of the same folder.

    Parameters
    ----------
    folder : Path
        The folder.
    what : str
        Title of the stage, for the message while waiting.
    """
    if folder in _held:
        yield
        return
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"outputs: {folder.parent}: {error.strerror}; choose another") from error
    lock = FileLock(folder.parent / f".{folder.name}.lock")
    try:
        lock.acquire(timeout=0)
    except Timeout:
        log(f"{what} is being made by another process: waiting for it")
        lock.acquire()
    _held.add(folder)
    try:
        yield
    finally:
        _held.remove(folder)
        lock.release()


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`, and rename it to `path` when the block has ended."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
