"""`avn ls [key=value ...]`: lists finished runs with their world, success rate and SPL.

A key is a column, and only runs with that value are listed: `avn ls agent=greedy seed=0,1`.
Options: `outputs=outputs`, `sort=-spl`, `format=table|csv|json`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from avn.core.errors import UserError
from avn.core.signals import exit_code_of
from avn.pipeline import run_list
from avn.pipeline.run_list import COLUMNS, FORMATS, NUMBERS, Row
from avn.reporting.world import trial_note

_OPTIONS = {"outputs": "outputs", "sort": "agent", "format": "table"}


def main(arguments: Sequence[str] | None = None) -> int:
    """List the runs and return the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if any(argument in ("-h", "--help") for argument in given):
        print(f"{__doc__}\nColumns: {', '.join(COLUMNS)}")
        return 0
    return exit_code_of("avn.ls", lambda: _answer(given))


def _answer(arguments: Sequence[str]) -> int:
    try:
        _list(arguments)
    except UserError as error:
        print(f"avn.ls: {error}", file=sys.stderr)
        return 2
    return 0


def _parse(arguments: Sequence[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the options and the filters of a command line."""
    options = dict(_OPTIONS)
    filters: dict[str, str] = {}
    for argument in arguments:
        key, equals, value = argument.partition("=")
        if not equals or not value:
            raise UserError(f"{argument}: not of the form key=value, such as agent=greedy")
        (options if key in options else filters)[key] = value
    if options["format"] not in FORMATS:
        raise UserError(f"format: '{options['format']}' is none of {', '.join(FORMATS)}")
    run_list.check_columns((*filters, options["sort"].removeprefix("-")))
    return options, filters


def _list(arguments: Sequence[str]) -> None:
    options, filters = _parse(arguments)
    rows = run_list.select(run_list.list_runs(Path(options["outputs"])), filters)
    rows = run_list.order(rows, options["sort"])
    if options["format"] == "table":
        _print_table(rows)
    else:
        print(run_list.as_csv(rows) if options["format"] == "csv" else run_list.as_json(rows))


def _print_table(rows: Sequence[Row]) -> None:
    """Print a line per run, without the columns in which all runs have the usual value."""
    usual = {"subset": "test", "episodes": "frozen"}
    shown = [key for key in COLUMNS if any(row[key] != usual.get(key, 0j) for row in rows)]
    table = [shown, *([_text(key, row[key]) for key in shown] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for line in table:
        cells = [
            text.rjust(width) if key in NUMBERS else text.ljust(width)
            for key, text, width in zip(shown, line, widths, strict=True)
        ]
        print("  ".join(cells).rstrip())
    if note := trial_note(str(row["split"]) for row in rows):
        print(note)
    print(f"{len(rows)} run{'' if len(rows) == 1 else 's'}")


def _text(key: str, value: object) -> str:
    if value is None:
        return "?"
    return f"{100 * float(str(value)):.1f} %" if key in ("success", "spl") else str(value)


if __name__ == "__main__":
    sys.exit(main())
