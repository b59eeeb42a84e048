"""Stages: what is made once, under which name it lies, and who may make it.

A stage's folder is named after a hash of everything its result depends on, so that equal
configs share one result. A lock beside the folder keeps two processes from making the same
thing at once; the second waits and finds it done.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from omegaconf import DictConfig, ListConfig, OmegaConf

from avn.errors import UserError

# Seconds that each stage of this process took, by name, without those of the stages it made on the
# way; and the stages that are being made, with the seconds of what they made on the way.
spent: dict[str, float] = {}
_within: list[float] = []
# Folders whose locks this process holds.
_held: set[Path] = set()


def digest(*parts: Any) -> str:
    """SHA-256, in hex, of plain values, configs and dataclasses; order of keys is of no account."""
    return hashlib.sha256(canonical(parts).encode()).hexdigest()


def file_hash(path: Path) -> str:
    """SHA-256, in hex, of a file's bytes."""
    found = path.stat()
    return _file_hash(path, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=64)
def _file_hash(path: Path, changed: int, size: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def canonical(value: Any) -> str:
    """The one JSON text of a value, on which `digest` is computed."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), default=_plain)


def _plain(value: Any) -> Any:
    if isinstance(value, DictConfig | ListConfig):
        return OmegaConf.to_container(value, resolve=True)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    if isinstance(value, np.ndarray):
        return [str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    raise TypeError(f"cannot hash a {type(value).__name__}")


def stage_folder(outputs: str | Path, stage: str, what: str, made_from: str) -> Path:
    """`outputs/<stage>/<what>-<hash8>`."""
    return Path(outputs) / stage / f"{what}-{made_from[:8]}"


def check_name(option: str, name: str) -> None:
    """Refuse a name that would lead a folder astray; raises `UserError` with the option."""
    if not name or name.startswith(".") or "/" in name or "\0" in name:
        raise UserError(f"{option}: '{name}' cannot name a folder; use letters, digits, - and _")


@dataclass(frozen=True)
class Stage:
    """What would be made.

    Attributes
    ----------
    what : str
        What it is.
    folder : Path
        Where it lies, or will.
    seconds : float
        How long it takes on two cores, roughly; without what it needs and is missing too.
    missing : bool
    """

    what: str
    folder: Path
    seconds: float
    missing: bool


class _AskedError(Exception):
    """Ends a call that only asks what it would make."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage


_only_asking = False


def ask(make: Callable[[], object]) -> Stage:
    """The first stage that a call would make or find, which it neither makes nor opens.

    Raises
    ------
    UserError
        What the call refuses before it comes to a stage.
    ValueError
        Where it comes to none.
    """
    global _only_asking
    _only_asking = True
    try:
        make()
    except _AskedError as asked:
        return asked.stage
    finally:
        _only_asking = False
    raise ValueError("nothing is made on this call")


def make_once(
    folder: Path,
    what: str,
    done: Callable[[], bool],
    make: Callable[[], None],
    auto: bool = True,
    seconds: float = 0.0,
) -> None:
    """Make what is missing in `folder`, unless it is there or another process makes it.

    Parameters
    ----------
    folder : Path
        Where the result lies; the lock stands beside it.
    what : str
        What is made, for the line that says so.
    done, make : callable
        Whether it is there, and what makes it; `make` goes on where a killed one stopped.
    auto : bool
        With False a missing result is refused instead.
    seconds : float
        How long it takes on two cores, for the line that says so.

    Raises
    ------
    UserError
        Where it is missing and `auto` is False.
    """
    if _only_asking:
        raise _AskedError(Stage(what, folder, seconds, not done()))
    if done():
        return
    if not auto:
        raise refusal(folder, what)
    with locked(folder, what):
        if done():
            return
        tell(f"{what} is missing: making it" + (f" (about {span(seconds)})" if seconds else ""))
        started = time.perf_counter()
        _within.append(0.0)
        try:
            make()
        finally:
            inner = _within.pop()
        took = time.perf_counter() - started
        spent[what] = spent.get(what, 0.0) + took - inner
        if _within:
            _within[-1] += took
        tell(f"{what} made in {span(took)}: {folder}")


def refusal(folder: Path, what: str) -> UserError:
    """The error where something is missing that must not be made."""
    return UserError(f"{folder}: {what} is missing and auto=false; leave auto=true to make it")


def span(seconds: float) -> str:
    """A length of time in words, such as `40 s` or `2.5 min`."""
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.1f} min"


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
        tell(f"{what} is being made by another process: waiting for it")
        lock.acquire()
    _held.add(folder)
    try:
        yield
    finally:
        _held.remove(folder)
        lock.release()


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`, and rename it to `path` once the block has ended."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def tell(line: str) -> None:
    """Print one line for the user, at once."""
    print(line, flush=True)
