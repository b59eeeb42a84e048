"""`python -m avn.reproduce`: evaluates all rows with all seeds and prints the table."""

from __future__ import annotations

import sys
from pathlib import Path

from omegaconf import DictConfig

from avn.config.cli import command
from avn.config.rows import compose_row
from avn.config.unread import refuse_unread
from avn.core.progress import log


@command("reproduce")
def main(cfg: DictConfig) -> Path:
    """Build what is missing, evaluate each row with each seed, and print the table.

    With `table=conditions` each row is evaluated in each condition, except in those that tell it
    what its network cannot be told.
    """
    from avn.pipeline.reproduction import check_lists

    check_lists(cfg)
    folder = _conditions(cfg) if cfg.conditions else _rows(cfg)
    log(str(folder))
    return folder


def _rows(cfg: DictConfig) -> Path:
    """Make the table of rows x scenes and sounds."""
    from avn.config.defaults import default_config
    from avn.pipeline.reproduction import reproduce, settings_of

    rows = [compose_row(cfg, row) for row in dict.fromkeys(cfg.rows)]
    refuse_unread("reproduce", cfg, settings_of(rows))
    return reproduce(cfg, rows, [default_config(row) for row in rows])


def _conditions(cfg: DictConfig) -> Path:
    """Make the table of rows x conditions."""
    from avn.pipeline.condition_table import tabulate
    from avn.pipeline.reproduction import settings_of
    from avn.pipeline.told import can_be_told

    pairs = [(row, own) for row in dict.fromkeys(cfg.rows) for own in dict.fromkeys(cfg.conditions)]
    composed = {pair: compose_row(cfg, *pair) for pair in pairs}
    # a row without such a network has no cell; if there is nothing else, it is refused
    composed = {pair: own for pair, own in composed.items() if can_be_told(own)} or composed
    refuse_unread("reproduce", cfg, settings_of([*composed.values()]))
    return tabulate(cfg, composed)


if __name__ == "__main__":
    sys.exit(main())
