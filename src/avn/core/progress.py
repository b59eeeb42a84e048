"""Messages to the user during long work: lines, durations and progress bars."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from importlib.util import find_spec

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from avn.core.heartbeat import Work, format_duration, reported

__all__ = ["bars_in", "format_duration", "log", "progress_bar", "progress_columns", "working"]

# Progress displays of open dashboards, the last of which takes new bars.
_shared: list[Progress] = []


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text(f"{speed:.0f} {task.fields['unit']}/s" if speed else "")


def progress_columns(console: Console) -> Progress:
    """Build a display of bars with a rate and the time left, not yet shown."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        _Rate(),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    return Progress(*columns, console=console, speed_estimate_period=60)


@contextmanager
def bars_in(progress: Progress) -> Iterator[None]:
    """Show the bars of the block in the display of a dashboard, each while its work lasts."""
    _shared.append(progress)
    try:
        yield
    finally:
        _shared.pop()


@contextmanager
def progress_bar(
    what: str, total: int, unit: str, done: int = 0
) -> Iterator[Callable[[int], None]]:
    """Show progress on the error stream: a bar, or lines where it is no terminal.

    Inside of an open dashboard the bar is part of it. The lines are those of `avn.core.heartbeat`.

    Parameters
    ----------
    what : str
        Description of the work.
    total : int
        Number of units of work.
    unit : str
        Name of the units, in the plural.
    done : int
        Number of units that were done before.

    Yields
    ------
    callable
        Function that advances the bar by a number of units.
    """
    if _shared:
        progress = _shared[-1]
        task = progress.add_task(what, total=total, completed=done, unit=unit)
        try:
            yield lambda count: progress.advance(task, count)
        finally:
            progress.remove_task(task)
        return
    console = Console(file=sys.stderr)
    if not _shows_bars(console):
        with reported(Work(what, total, unit, done)) as work:
            yield work.advance
        return
    with progress_columns(console) as progress:
        task = progress.add_task(what, total=total, completed=done, unit=unit)
        yield lambda count: progress.advance(task, count)


@contextmanager
def working(what: str) -> Iterator[None]:
    """Say from time to time how long the block has lasted, where no terminal shows it.

    A progress bar of the block says more, and replaces this while it is open.

    Parameters
    ----------
    what : str
        Description of the work.
    """
    bars = _shared or _shows_bars(Console(file=sys.stderr))
    with nullcontext() if bars else reported(Work(what)):
        yield


def _shows_bars(console: Console) -> bool:
    """Return whether bars can be drawn: in a terminal, and in a notebook with ipywidgets."""
    return console.is_terminal or (console.is_jupyter and find_spec("ipywidgets") is not None)


def log(line: str) -> None:
    """Print one line for the user, at once."""
    print(line, flush=True)
