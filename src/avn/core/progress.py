"""Messages to the user during long work: lines, durations and progress bars."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

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
def progress_bar(what: str, total: int, unit: str) -> Iterator[Callable[[int], None]]:
    """Show a progress bar on the error stream, or in an open dashboard.

    Parameters
    ----------
    what : str
        Description of the work.
    total : int
        Number of units of work.
    unit : str
        Name of the units, in the plural.

    Yields
    ------
    callable
        Function that advances the bar by a number of units.
    """
    if _shared:
        progress = _shared[-1]
        task = progress.add_task(what, total=total, unit=unit)
        try:
            yield lambda count: progress.advance(task, count)
        finally:
            progress.remove_task(task)
        return
    with progress_columns(Console(file=sys.stderr)) as progress:
        task = progress.add_task(what, total=total, unit=unit)
        yield lambda count: progress.advance(task, count)


def log(line: str) -> None:
    """Print one line for the user, at once."""
    print(line, flush=True)


def format_duration(seconds: float) -> str:
    """Format a duration in seconds, such as `40 s` or `2.5 min`."""
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.1f} min"
