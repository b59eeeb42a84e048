"""What the terminal shows while a table is made: stages, bars, time left, rows as they fill."""

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
    """A live display on the error stream; it shows nothing where that is no terminal.

    Parameters
    ----------
    stages : sequence of (str, float)
        What is missing, in the order in which it is made: title and expected seconds.
    rows : sequence of str
        The rows of the table.
    paper : dict of str to str
        What the paper says of a row.
    console : Console, optional
        Where it is shown, in place of the error stream.
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
        self._open.close()

    def made(self) -> None:
        """The stage that was being made is there; the next one begins."""
        now = time.monotonic()
        self._took.append(now - self._began)
        self._began = now

    def fill(self, row: str, text: str) -> None:
        """Show what has come of a row so far."""
        self._rows[row] = text

    def time_left(self) -> float:
        """Seconds that it still takes, at the pace of the stages that were made."""
        planned = [seconds for _, seconds in self._stages]
        done = len(self._took)
        expected = sum(planned[:done])
        pace = sum(self._took) / expected if expected > 60.0 else 1.0
        if done == len(planned):
            return 0.0
        current = max(0.0, planned[done] * pace - (time.monotonic() - self._began))
        return current + pace * sum(planned[done + 1 :])

    def render(self) -> RenderableType:
        """All of it."""
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
