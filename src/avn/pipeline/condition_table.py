"""Table of rows x conditions: evaluation of each row in each condition, and the table's files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pandas as pd
from omegaconf import DictConfig

from avn.acoustics.sound_names import joined_names
from avn.core.files import atomic_write, stage_folder
from avn.core.hashing import digest
from avn.navigation.episodes import ONE_SOUND
from avn.pipeline.benchmark import (
    OF_THE_PACKAGE,
    changed_settings,
    has_published_networks,
    named,
    note_of,
)
from avn.pipeline.dynamics import GROUPS
from avn.pipeline.reproduction import make_runs, runs_of, with_networks
from avn.pipeline.run import Evaluation, agent_label
from avn.pipeline.sounds import sound_files
from avn.reporting import condition_table, results, table
from avn.reporting.condition_table import CONDITION
from avn.reporting.finished_run import read_episodes

# Files of the table.
CELLS, TABLE = "cells.csv", "table.md"
# Groups that the caption names, with their settings.
_WORLD = ("acoustics", "protocol", "split")


def tabulate(
    cfg: DictConfig,
    composed: Mapping[tuple[str, str], DictConfig],
    default_of: Callable[[DictConfig, str], DictConfig],
) -> Path:
    """Build what is missing, evaluate each row in each condition, and print the table.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.reproduce`.
    composed : mapping of (str, str) to DictConfig
        Config of each row and condition, as of `avn.eval`.
    default_of : callable
        Returns the default config of a row in a condition; see `avn.config.defaults`.

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
    order = list(dict.fromkeys(cfg.conditions))
    caption = _caption(list(composed.values()), changed_in(composed, default_of))
    table.print_table(condition_table.terminal(found, order, rows), caption)
    target = stage_folder(cfg.outputs, "reproduce", "conditions", digest([f.name for f in folders]))
    results.write_csv(found, target / CELLS)
    with atomic_write(target / TABLE) as part:
        part.write_text(_markdown(found, order, rows, caption), encoding="utf-8")
    return target


def changed_in(
    composed: Mapping[tuple[str, str], DictConfig],
    default_of: Callable[[DictConfig, str], DictConfig],
) -> dict[str, str]:
    """Return the settings in which a table differs from its rows and conditions.

    Parameters
    ----------
    composed, default_of
        As for `tabulate`. Each row is examined in one condition, and each condition with the row
        that reads most settings.
    """
    read = {row: len(Evaluation(cfg).read()) for (row, _), cfg in composed.items()}
    by_settings = sorted(composed, key=lambda pair: read[pair[0]])
    of_rows = {row: (row, condition) for row, condition in composed}
    of_conditions = {condition: (row, condition) for row, condition in by_settings}
    changed: dict[str, str] = {}
    for pair in dict.fromkeys([*of_rows.values(), *of_conditions.values()]):
        cfg, default = composed[pair], default_of(composed[pair], pair[1])
        own = changed_settings(cfg, default)
        for group in GROUPS:
            if cfg[group].name != default[group].name:
                own = {key: value for key, value in own.items() if key.split(".")[0] != group}
                own[group] = str(cfg[group].name)
        if sound_files(cfg) != sound_files(default):
            own["sound"] = joined_names(list(sound_files(cfg)))
        changed |= own
    return changed


def _caption(configs: Sequence[DictConfig], changed: Mapping[str, str]) -> str:
    """Return the world that all conditions share, what is changed, and with `mini` its warning."""
    cfg = configs[0]
    acoustics, protocol, split = (named(cfg, group, changed) for group in _WORLD)
    parts = [acoustics, protocol]
    if cfg.look != results.USUAL_LOOK:
        parts.append(f"look {cfg.look}")
    parts.append(f"{cfg.subset} apartments of {split}")
    if cfg.episodes == ONE_SOUND:
        parts.append("one sound an episode")
    if any(map(has_published_networks, configs)):
        parts.append(OF_THE_PACKAGE)
    told = ("look", *(f"{group}." for group in _WORLD))
    if others := [f"{key}={own}" for key, own in changed.items() if not key.startswith(told)]:
        parts.append(f"with {', '.join(others)}")
    return "\n".join(filter(None, ("; ".join(parts), note_of(cfg))))


def _markdown(cells: pd.DataFrame, order: list[str], rows: list[str], caption: str) -> str:
    networks = int(cells["networks"].max())
    world, *note = caption.splitlines()
    means = f"means of {networks} networks, " if networks > 1 else ""
    over = "networks, apartments" if networks > 1 else "apartments"
    head = (
        f"Success rate / SPL in % ({world}); {means}95 % intervals over {over}, sources and "
        "episodes below."
    )
    return "\n\n".join((head, *note, condition_table.markdown(cells, order, rows)))
