"""Names, locks and atomic writes of what lies under `outputs`."""

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
    """`outputs/<stage>/<what>-<hash8>`."""
    return Path(outputs) / stage / f"{what}-{made_from[:8]}"


def check_name(option: str, name: str) -> None:
    """Refuse a name that would lead a folder astray; raises `UserError` with the option."""
    if not name or name.startswith(".") or "/" in name or "\0" in name:
        raise UserError(f"{option}: '{name}' cannot name a folder; use letters, digits, - and _")


@contextmanager
def locked(folder: Path, what: str) -> Iterator[None]:
    """Hold the lock of a stage's folder; it is freed when the process ends, however it ends.

    Who holds it already, since one stage of a folder needs another of the same folder, goes on.
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
    """Give a temporary path beside `path`, and rename it to `path` once the block has ended."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
