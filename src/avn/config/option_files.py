"""Hydra plugin that types config options by the classes that they name in `_target_`.

It reads the package's config files and those of the user's folders (`--config-dir FOLDER`).
"""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hydra._internal.core_plugins.file_config_source import FileConfigSource
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigResult, ConfigSource
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import DictConfig, ListConfig, OmegaConf, open_dict

from avn.apartments.settings import SplitConfig
from avn.config.folder import conf_folder, without_folders
from avn.config.renamed import check_file
from avn.config.schema import BASES, SCHEMAS
from avn.config.signatures import is_option, with_signature
from avn.core.errors import UserError

# Config folders of the current command line.
_folders: list[str] = []
# Files of the package as they were read, by path, time of change and size: one command composes
# several configs.
_read_before: dict[tuple[Path, int, int], ConfigResult] = {}


def take_folders(arguments: list[str]) -> list[str]:
    """Register the config folders of a command line and return the other arguments.

    Raises
    ------
    UserError
        Where a given path is no folder.
    """
    rest, folders = without_folders(arguments)
    _folders[:] = map(str, folders)
    return rest


def only_package() -> bool:
    """Return whether the command line has no config folder of the user."""
    return not _folders


def option_names(group: str) -> list[str]:
    """Return the names of the options of a group, those of the user's folders among them."""
    places = [*map(Path, _folders), conf_folder()]
    return sorted({path.stem for place in places for path in (place / group).glob("*.yaml")})


def option_file(group: str, option: str) -> Path | None:
    """Return the file of an option, of the user's folders first; None where there is none."""
    places = [*map(Path, _folders), conf_folder()]
    paths = (place / group / f"{option}.yaml" for place in places)
    return next((path for path in paths if path.is_file()), None)


@contextmanager
def package_only() -> Iterator[None]:
    """Leave the config folders of the command line out of what is composed in the block."""
    folders = list(_folders)
    _folders.clear()
    try:
        yield
    finally:
        _folders[:] = folders


class OptionFiles(ConfigSource):
    """Config source: a folder of files in which each option has the schema of its class.

    Parameters
    ----------
    provider : str
        Name of the source in Hydra's messages.
    path : str
        Path of the folder, with the scheme `avn://`.
    """

    def __init__(self, provider: str, path: str) -> None:
        super().__init__(provider, path)
        self._files = FileConfigSource(provider, f"file://{self.path}")

    @staticmethod
    def scheme() -> str:
        """Return the scheme of the source in search paths."""
        return "avn"

    def load_config(self, config_path: str) -> ConfigResult:
        """Read a config file, refuse former names, and add the schema of each option."""
        path = (Path(self.path) / self._normalize_file_name(config_path)).resolve()
        if not path.is_relative_to(conf_folder().resolve()) or not path.is_file():
            return self._load(config_path)  # a class of the user's own may have changed too
        status = path.stat()
        key = path, status.st_mtime_ns, status.st_size
        if key not in _read_before:
            _read_before[key] = self._load(config_path)
        return copy.deepcopy(_read_before[key])  # Hydra changes what it is given

    def _load(self, config_path: str) -> ConfigResult:
        result = self._files.load_config(config_path)
        node = result.config
        if not isinstance(node, DictConfig):
            return result
        is_global = result.header.get("package") == "_global_"
        check_file(config_path, node, is_global)
        if is_global:
            for group in map(str, list(node)):
                if is_option(group, node[group]):
                    node[group] = with_signature(group, node[group])
        else:
            result.config = _typed(config_path, node)
        return result

    def is_group(self, config_path: str) -> bool:
        """Return whether the folder has a group of this name."""
        return self._files.is_group(config_path)

    def is_config(self, config_path: str) -> bool:
        """Return whether the folder has a file of this name."""
        return self._files.is_config(config_path)

    def available(self) -> bool:
        """Return whether the folder exists."""
        return self._files.available()

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """Return the names of the options of a group."""
        return self._files.list(config_path, results_filter)


class OptionFilesPath(SearchPathPlugin):
    """Plugin that puts `OptionFiles` into Hydra's search path, the user's folders first."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Replace the package's folder in the search path and prepend the user's folders."""
        ours = conf_folder().resolve()
        for element in search_path.get_path():
            path = (element.path or "").removeprefix("file://")
            if "://" not in path and Path(path).resolve() == ours:
                element.path = f"avn://{ours}"
        for folder in _folders:
            search_path.prepend("command-line", f"avn://{folder}")


def _is_named(group: str) -> bool:
    """Return True if options of a group have a name, which is that of the file by default."""
    base = SplitConfig if group == "split" else BASES.get(group)
    return base is not None and any(field.name == "name" for field in dataclasses.fields(base))


def _on_top(group: str, node: DictConfig, defaults: ListConfig) -> tuple[DictConfig, ListConfig]:
    """Merge an option with a class of its own onto the options of its group that it names.

    Hydra would merge the schema of one class into that of the other. Here, the settings are merged
    first, and the class of the option then determines the schema.
    """
    kept: list[Any] = []
    below: Any = OmegaConf.create()
    for default in defaults:
        if not isinstance(default, str) or default == "_self_":
            kept.append(default)
            continue
        base = _read_option(group, default)
        kept += [own for own in base.pop("defaults", []) if own != "_self_"]
        below = OmegaConf.merge(below, base)
    merged, left = OmegaConf.merge(below, node), OmegaConf.create(kept)
    assert isinstance(merged, DictConfig)
    return merged, left


def _read_option(group: str, name: str) -> DictConfig:
    for folder in (*map(Path, _folders), conf_folder()):
        path = folder / group / f"{name}.yaml"
        if path.is_file():
            found = OmegaConf.load(path)
            assert isinstance(found, DictConfig)
            return found
    raise UserError(f"{group}: there is no option '{name}', on which another one stands")


def _typed(name: str, node: DictConfig) -> DictConfig:
    """Return an option with its schema; an option with `defaults` gets it from its parent."""
    defaults = node.pop("defaults", None)
    if "/" in name and any(str(entry).endswith("schema") for entry in defaults or ()):
        raise UserError(
            f"{name}: its defaults name a schema, which options need no more; remove it"
        )
    group, _, option = name.partition("/")
    if option and _is_named(group) and "name" not in node:
        node["name"] = option
    if is_option(group, node) and defaults is not None:
        node, defaults = _on_top(group, node, defaults)
    if is_option(group, node):
        node = with_signature(group, node)
    elif group in SCHEMAS and defaults is None:
        node = OmegaConf.merge(OmegaConf.structured(SCHEMAS[group]), node)  # type: ignore
    if defaults is not None:
        with open_dict(node):
            node["defaults"] = defaults
    return node


PLUGINS = (OptionFiles, OptionFilesPath)
