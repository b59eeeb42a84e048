"""Networks of a row for `avn.train agent=ROW`, whose model names a network of its own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import yaml

from avn.config.option_files import option_file
from avn.core.errors import UserError


def with_row_networks(arguments: Sequence[str]) -> list[str]:
    """Return the command line with the options of the row that the model would replace.

    The option of the group `model` chooses a network, and Hydra applies it after that of `agent`:
    `model=sound_cnn` would so train its default network and not that of the row.

    Parameters
    ----------
    arguments : sequence of str
        Overrides of `avn.train`.

    Raises
    ------
    UserError
        For several rows, of which each has its own network.
    """
    given = dict(argument.partition("=")[::2] for argument in arguments)
    if "," in given.get("agent", "") and _overrides("model", given.get("model")):
        raise UserError(
            f"agent={given['agent']}: model={given['model']} has one network for all rows of a "
            "sweep; train the rows one after another"
        )
    row, model = (_overrides(group, given.get(group)) for group in ("agent", "model"))
    row = _overrides("mapper", given.get("mapper", row.get("mapper"))) | row
    added = [f"{group}={row[group]}" for group in row if group in model and group not in given]
    place = [*arguments].index(f"model={given['model']}") + 1 if added else 0  # among overrides
    return [*arguments[:place], *added, *arguments[place:]]


def _overrides(group: str, option: str | None) -> dict[str, str]:
    """Return the options of other groups that an option's file chooses, by group."""
    path: Path | None = option_file(group, option) if option else None
    if path is None:
        return {}
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    defaults = content.get("defaults") if isinstance(content, dict) else None
    return {
        key.removeprefix("override /").partition("@")[0]: value
        for entry in defaults or []
        if isinstance(entry, dict)
        for key, value in entry.items()
        if key.startswith("override /") and not key.partition("@")[2].startswith("training.")
    }
