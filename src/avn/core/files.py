"""Names, locks and atomic writes of files under `outputs`."""

from __future__ import annotations

import errno
import os
import re
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


def partial_folder(path: Path) -> Path:
    """Return the folder of the temporary files of a file that is made in several parts."""
    return path.parent / f".{path.stem}"


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
    lock = FileLock(folder.parent / f".{folder.name}.lock")
    with writing(folder.parent):
        folder.parent.mkdir(parents=True, exist_ok=True)
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
    """Yield a temporary path beside `path`, and rename it to `path` when the block has ended.

    Raises
    ------
    UserError
        If the file cannot be written; none is left then.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield part
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)


# What a user can do about a file that cannot be written, by the cause.
_FULL = "free some space, or choose another folder, and run the same command again"
_REFUSED = "choose another folder, such as by outputs=FOLDER"
_WRITE_ERRORS = {
    errno.ENOSPC: _FULL,
    errno.EDQUOT: _FULL,
    errno.EFBIG: _FULL,
    errno.EACCES: _REFUSED,
    errno.EPERM: _REFUSED,
    errno.EROFS: _REFUSED,
    errno.ENOTDIR: _REFUSED,
    errno.EISDIR: _REFUSED,
    errno.EEXIST: _REFUSED,
    errno.EIO: "examine the disk, or choose another folder",
}


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Name the file or folder in errors of the block that say that it cannot be written.

    Raises
    ------
    UserError
        For a full disk, a quota, a missing permission and the like.
    """
    try:
        yield
    except Exception as error:
        if line := write_failure(error, path):
            raise UserError(line) from error
        raise


def write_failure(error: BaseException, path: str | Path) -> str | None:
    """Return the line for an error if it, or its cause, is a file that cannot be written.

    Parameters
    ----------
    error : BaseException
        The error.
    path : str or Path
        The file or folder, in case the error does not name it.

    Returns
    -------
    str or None
        None for any other error.
    """
    link: BaseException | None = error
    while link is not None:
        if isinstance(link, UserError):
            return None
        code = _code(link)
        if code in _WRITE_ERRORS:
            named = getattr(link, "filename", None) or path
            return f"{named} cannot be written ({os.strerror(code)}); {_WRITE_ERRORS[code]}"
        link = link.__cause__ or link.__context__
    return None


def _code(error: BaseException) -> int:
    """Return the number of a system error, which HDF5 and some others only have in their text."""
    if isinstance(error, OSError) and error.errno:
        return error.errno
    found = re.search(r"errno = (\d+)|\[Errno (\d+)\]|file.*\((\d+)\)$", str(error))
    return int(next(filter(None, found.groups()))) if found else 0
