"""Live display of a table in progress: stages, progress bars, time left, finished rows."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from types import TracebackType

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from avn.core.progress import bars_in, format_duration, progress_columns

# Lines beside the stages and rows: headings, stages taken together, bars, time.
_OTHERS = 8


class Dashboard:
    """Live display on the standard error stream; without a terminal nothing is shown.

    Parameters
    ----------
    stages : sequence of (str, float)
        Missing stages in the order of their making: title and expected seconds.
    rows : sequence of str
        Names of the table's rows.
    paper : dict of str to str
        The paper's results by row.
    console : Console, optional
        Console to use instead of the standard error stream.
    """

    def __init__(
        self,
        stages: Sequence[tuple[str, float]],
        rows: Sequence[str],
        paper: dict[str, str],
        console: Console | None = None,
    ) -> None:
        self._stages, self._paper = list(stages), paper
        self._rows = dict.fromkeys(rows, "")
        self._took: list[float] = []
        self._started = self._began = time.monotonic()
        self._console = console or Console(file=sys.stderr)
        self._bars = progress_columns(self._console)
        self._open = ExitStack()

    def __enter__(self) -> Dashboard:
        """Start the display and the clock."""
        if self._console.is_terminal:
            self._open.enter_context(bars_in(self._bars))
            live = Live(
                console=self._console,
                get_renderable=self.render,
                refresh_per_second=2,
                # what is printed for a file or a pipe must go on reaching it
                redirect_stdout=sys.stdout.isatty(),
            )
            self._open.enter_context(live)
        self._started = self._began = time.monotonic()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the display.

        Parameters
        ----------
        kind, error, trace
            Exception that left the block; unused.
        """
        self._open.close()

    def made(self) -> None:
        """Mark the current stage as finished and the next one as begun."""
        now = time.monotonic()
        self._took.append(now - self._began)
        self._began = now

    def fill(self, row: str, text: str) -> None:
        """Show the result of a row so far."""
        self._rows[row] = text

    def time_left(self) -> float:
        """Estimate the seconds left, at the pace of the finished stages."""
        planned = [seconds for _, seconds in self._stages]
        done = len(self._took)
        expected = sum(planned[:done])
        pace = sum(self._took) / expected if expected > 60.0 else 1.0
        if done == len(planned):
            return 0.0
        current = max(0.0, planned[done] * pace - (time.monotonic() - self._began))
        return current + pace * sum(planned[done + 1 :])

    def render(self) -> RenderableType:
        """Return the whole display."""
        passed = format_duration(time.monotonic() - self._started)
        left = f"{passed} passed, about {format_duration(self.time_left())} left"
        return Group(Text(left, style="bold"), self._row_table(), self._stage_table(), self._bars)

    def _stage_table(self) -> Table:
        table = Table(box=None, pad_edge=False)
        table.add_column("stage", ratio=1, no_wrap=True, overflow="ellipsis")
        table.add_column("planned", justify="right")
        table.add_column("took", justify="right")
        done = len(self._took)
        lines = max(2, self._console.height - len(self._rows) - _OTHERS)
        first = max(0, done - lines // 3)
        last = first + lines
        if first:
            table.add_row(
                f"{first} stages", "", format_duration(sum(self._took[:first])), style="dim"
            )
        for number, (title, seconds) in list(enumerate(self._stages))[first:last]:
            took, style = "", ""
            if number < done:
                took, style = format_duration(self._took[number]), "green"
            elif number == done:
                took, style = (
                    f"{format_duration(time.monotonic() - self._began)} ...",
                    "bold yellow",
                )
            table.add_row(Text(title), format_duration(seconds), took, style=style)
        rest = self._stages[last:]
        if rest:
            planned = format_duration(sum(seconds for _, seconds in rest))
            table.add_row(f"{len(rest)} more stages", planned, "", style="dim")
        return table

    def _row_table(self) -> Table:
        table = Table(box=None, pad_edge=False)
        for name in ("row", "SR / SPL", "paper"):
            table.add_column(name, justify="left" if name == "row" else "right")
        for name, text in self._rows.items():
            table.add_row(Text(name), text or "-", self._paper.get(name, "-"))
        return table
