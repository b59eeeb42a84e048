"""`python -m avn.reproduce`: evaluates all rows with all seeds and prints the table."""

from __future__ import annotations

import sys
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from avn.config.cli import command
from avn.config.rows import compose_row
from avn.config.unread import refuse_unread
from avn.core.errors import UserError
from avn.core.progress import log

# Option of the group `table` whose table has conditions.
CONDITIONS = "conditions"


@command("reproduce")
def main(cfg: DictConfig) -> Path:
    """Build what is missing, evaluate each row with each seed, and print the table.

    With `table=conditions` each row is evaluated in each condition, except in those that tell it
    what its network cannot be told.
    """
    from avn.pipeline.reproduction import check_lists

    check_lists(cfg)
    if HydraConfig.get().runtime.choices.get("table") == CONDITIONS and not cfg.conditions:
        raise UserError("conditions: empty; give at least one, such as conditions=unheard")
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
    from avn.config.defaults import default_config
    from avn.pipeline.condition_table import tabulate
    from avn.pipeline.reproduction import settings_of
    from avn.pipeline.told import can_be_told

    pairs = [(row, own) for row in dict.fromkeys(cfg.rows) for own in dict.fromkeys(cfg.conditions)]
    composed = {pair: compose_row(cfg, *pair) for pair in pairs}
    untold = [pair for pair, own in composed.items() if not can_be_told(own)]
    if len(untold) == len(composed):
        raise UserError(
            f"rows: no sound network of {', '.join(dict.fromkeys(row for row, _ in untold))} can "
            "be told the category of the goal; give rows=belief_told or distractor.told=false"
        )
    for condition in dict.fromkeys(condition for _, condition in untold):
        rows = ", ".join(row for row, own in untold if own == condition)
        log(f"{condition}: no cell for {rows}, which cannot be told a category")
    composed = {pair: own for pair, own in composed.items() if pair not in untold}
    refuse_unread("reproduce", cfg, settings_of([*composed.values()]))
    return tabulate(cfg, composed, default_config)


if __name__ == "__main__":
    sys.exit(main())
