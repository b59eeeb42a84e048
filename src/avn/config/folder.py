"""Folders of config files: those of the package and those of `--config-dir MINE`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from avn.core.errors import UserError

_OPTIONS = ("--config-dir", "-cd")


def conf_folder() -> Path:
    """Return the folder of configs: in the package in a wheel, at the top of a checkout."""
    packaged = Path(__file__).parents[1] / "conf"
    return packaged if packaged.is_dir() else Path(__file__).parents[3] / "conf"


def without_folders(arguments: Iterable[str]) -> tuple[list[str], list[Path]]:
    """Split a command line into the arguments without `--config-dir`, and its folders.

    Raises
    ------
    UserError
        Where a given path is no folder.
    """
    rest, folders, given = [], [], iter(arguments)
    for argument in given:
        option, equals, value = argument.partition("=")
        if option not in _OPTIONS:
            rest.append(argument)
            continue
        folder = value if equals else next(given, "")
        if not Path(folder).expanduser().is_dir() or not folder:
            raise UserError(f"{option}: '{folder}' is no folder; give one with config files")
        folders.append(Path(folder).expanduser().resolve())
    return rest, folders
