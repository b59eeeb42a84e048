"""Stages: what is made once, under which name it lies, and who may make it.

A stage's folder is named after a hash of everything its result depends on, so that equal
configs share one result. A lock beside the folder keeps two processes from making the same
thing at once; the second waits and finds it done.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from avn.core.errors import UserError
from avn.core.files import locked
from avn.core.progress import span, tell

# Seconds that each stage of this process took, by name, without those of the stages it made on the
# way; and the stages that are being made, with the seconds of what they made on the way.
spent: dict[str, float] = {}
_within: list[float] = []


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
