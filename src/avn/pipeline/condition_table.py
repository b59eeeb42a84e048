"""Table of rows x conditions: evaluation of each row in each condition, and the table's files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from omegaconf import DictConfig

from avn.core.files import atomic_write, stage_folder
from avn.core.hashing import digest
from avn.pipeline.benchmark import OF_THE_PACKAGE, has_published_networks, note_of
from avn.pipeline.reproduction import make_runs, runs_of, with_networks
from avn.pipeline.run import agent_label
from avn.reporting import condition_table, results, table
from avn.reporting.condition_table import CONDITION
from avn.reporting.finished_run import read_episodes

# Files of the table.
CELLS, TABLE = "cells.csv", "table.md"


def tabulate(cfg: DictConfig, composed: Mapping[tuple[str, str], DictConfig]) -> Path:
    """Build what is missing, evaluate each row in each condition, and print the table.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.reproduce`.
    composed : mapping of (str, str) to DictConfig
        Config of each row and condition, as of `avn.eval`.

    Returns
    -------
    Path
        Folder of the table.

    Raises
    ------
    UserError
        Where an option cannot work, or something is missing and `auto` is false.
    """
    cells = {key: runs_of(cfg, config) for key, config in composed.items()}
    configs = [config for runs in cells.values() for config in runs]
    names = [f"{row} {condition}" for (row, condition), runs in cells.items() for _ in runs]
    folders = make_runs(configs, names)
    conditions = [condition for (_, condition), runs in cells.items() for _ in runs]
    episodes = with_networks(
        [
            read_episodes(folder).assign(**{CONDITION: condition})
            for folder, condition in zip(folders, conditions, strict=True)
        ],
        [config.train_seed for config in configs],
    )
    found = condition_table.condition_cells(episodes)
    rows = list(dict.fromkeys(agent_label(config) for config in configs))
    order = list(dict.fromkeys(conditions))
    caption = _caption(configs)
    table.print_table(condition_table.terminal(found, order, rows), caption)
    target = stage_folder(cfg.outputs, "reproduce", "conditions", digest([f.name for f in folders]))
    results.write_csv(found, target / CELLS)
    with atomic_write(target / TABLE) as part:
        part.write_text(_markdown(found, order, rows, caption), encoding="utf-8")
    return target


def _caption(configs: Sequence[DictConfig]) -> str:
    """Return the world that all conditions share, and with `mini` its warning."""
    cfg = configs[0]
    parts = [f"acoustics {cfg.acoustics.name}", f"protocol {cfg.protocol.name}"]
    if cfg.look != results.USUAL_LOOK:
        parts.append(f"look {cfg.look}")
    parts += [f"{cfg.subset} apartments of {cfg.split.name}", "one sound an episode"]
    if any(map(has_published_networks, configs)):
        parts.append(OF_THE_PACKAGE)
    return "\n".join(filter(None, ("; ".join(parts), note_of(cfg))))


def _markdown(cells: pd.DataFrame, order: list[str], rows: list[str], caption: str) -> str:
    networks = int(cells["networks"].max())
    world, *note = caption.splitlines()
    head = (
        f"Success rate / SPL in % ({world}); means of {networks} networks, "
        f"95 % intervals over networks, apartments, sources and episodes below."
    )
    return "\n\n".join((head, *note, condition_table.markdown(cells, order, rows)))
