"""Lines about work in progress, for output that is no terminal, such as the log of a batch job.

A thread prints a line from time to time, whether or not the work advances: what is being done, how
much of it, its rate and the time left.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

# Seconds from the begin of the first work to its first line, and between two lines.
FIRST, INTERVAL = 5.0, 30.0


class Work:
    """Work in progress.

    Parameters
    ----------
    what : str
        Description of the work.
    total : int
        Number of units of work, 0 where it is not counted.
    unit : str
        Name of the units, in the plural.
    done : int
        Number of units that were done before.
    """

    def __init__(self, what: str, total: int = 0, unit: str = "", done: int = 0) -> None:
        self.what, self.total, self.unit = what, total, unit
        self._before = self._done = done
        self._started = time.monotonic()

    def advance(self, count: int) -> None:
        """Count further units as done."""
        self._done += count

    def line(self) -> str:
        """Describe the state of the work in one line."""
        passed = time.monotonic() - self._started
        if not self.total:
            return f"{self.what}: {format_duration(passed)} so far"
        text = f"{self.what}: {self._done} of {self.total} {self.unit}"
        rate = (self._done - self._before) / passed if passed else 0.0
        if not rate:
            return f"{text}, {format_duration(passed)} so far"
        left = format_duration((self.total - self._done) / rate)
        return f"{text}, {rate:.3g} {self.unit}/s, about {left} left"


# Work in progress, the innermost last; and when the next line is due.
_open: list[Work] = []
_due = 0.0
_lock = threading.Lock()


@contextmanager
def reported(work: Work) -> Iterator[Work]:
    """Print a line about the work from time to time, while the block lasts.

    Of work within other work, only the innermost is reported.

    Parameters
    ----------
    work : Work
        The work; the block advances it.
    """
    global _due
    with _lock:
        if not _open:
            _due = max(_due, time.monotonic() + FIRST)
        _open.append(work)
    ended = threading.Event()
    if len(_open) == 1:
        threading.Thread(target=_report_until, args=(ended,), daemon=True).start()
    try:
        yield work
    finally:
        with _lock:
            _open.remove(work)
        ended.set()


def _report_until(ended: threading.Event) -> None:
    global _due
    while not ended.wait(max(0.01, _due - time.monotonic())):
        with _lock:
            now, line = time.monotonic(), _open[-1].line() if _open else ""
            if now < _due or not line:
                continue
            _due = now + INTERVAL
        with suppress(OSError, ValueError):  # of a stream that is closed
            print(line, file=sys.stderr, flush=True)


def format_duration(seconds: float) -> str:
    """Format a duration in seconds, such as `40 s` or `2.5 min`."""
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.1f} min"
