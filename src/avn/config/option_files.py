"""Config files whose options are typed by the classes they name: ours and those of the user.

A user's folders are named on the command line, `--config-dir FOLDER`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hydra._internal.core_plugins.file_config_source import FileConfigSource
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigResult, ConfigSource
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import DictConfig, ListConfig, OmegaConf, open_dict

from avn.config.folder import conf_folder, without_folders
from avn.config.renamed import check_file
from avn.config.schema import SCHEMAS
from avn.config.signatures import is_option, with_signature
from avn.core.errors import UserError

# The folders of the command line that is being run.
_folders: list[str] = []


def take_folders(arguments: list[str]) -> list[str]:
    """Take the config folders out of a command line; gives what is left of it.

    Raises
    ------
    UserError
        Where one is no folder.
    """
    rest, folders = without_folders(arguments)
    _folders[:] = map(str, folders)
    return rest


class OptionFiles(ConfigSource):
    """A folder of config files in which an option has the schema of its class."""

    def __init__(self, provider: str, path: str) -> None:
        super().__init__(provider, path)
        self._files = FileConfigSource(provider, f"file://{self.path}")

    @staticmethod
    def scheme() -> str:
        return "avn"

    def load_config(self, config_path: str) -> ConfigResult:
        found = self._files.load_config(config_path)
        node = found.config
        if not isinstance(node, DictConfig):
            return found
        is_global = found.header.get("package") == "_global_"
        check_file(config_path, node, is_global)
        if is_global:
            for own in map(str, list(node)):
                if is_option(own, node[own]):
                    node[own] = with_signature(own, node[own])
        else:
            found.config = _typed(config_path, node)
        return found

    def is_group(self, config_path: str) -> bool:
        return self._files.is_group(config_path)

    def is_config(self, config_path: str) -> bool:
        return self._files.is_config(config_path)

    def available(self) -> bool:
        return self._files.available()

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        return self._files.list(config_path, results_filter)


class OptionFilesPath(SearchPathPlugin):
    """Lets `OptionFiles` read the user's folders, which come first, and ours."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        ours = conf_folder().resolve()
        for element in search_path.get_path():
            path = (element.path or "").removeprefix("file://")
            if "://" not in path and Path(path).resolve() == ours:
                element.path = f"avn://{ours}"
        for folder in _folders:
            search_path.prepend("command-line", f"avn://{folder}")


def _on_top(group: str, node: DictConfig, defaults: ListConfig) -> tuple[DictConfig, ListConfig]:
    """An option with a class of its own, on top of the options of its group that it names.

    Hydra would merge the schema of the one class into that of the other. Here the settings are
    merged first, and the class of the option says which there are.
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
    """An option with its schema; one that stands on another of its group gets it from that."""
    defaults = node.pop("defaults", None)
    if "/" in name and any(str(own).endswith("schema") for own in defaults or ()):
        raise UserError(
            f"{name}: its defaults name a schema, which options need no more; remove it"
        )
    group = name.split("/")[0]
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
