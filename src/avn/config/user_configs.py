"""Config folders of the user's, `--config-dir MINE`, whose classes bring their own schemas."""

from __future__ import annotations

from pathlib import Path

from hydra._internal.core_plugins.file_config_source import FileConfigSource
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigResult, ConfigSource
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import DictConfig

from avn.config.signatures import is_foreign, with_signature
from avn.core.errors import UserError

_OPTIONS = ("--config-dir", "-cd")
# The folders of the command line that is being run.
_folders: list[str] = []


def take_folders(arguments: list[str]) -> list[str]:
    """Take the config folders out of a command line; gives what is left of it.

    Raises
    ------
    UserError
        Where one is no folder.
    """
    _folders.clear()
    rest, given = [], iter(arguments)
    for argument in given:
        option, equals, value = argument.partition("=")
        if option not in _OPTIONS:
            rest.append(argument)
            continue
        folder = value if equals else next(given, "")
        if not Path(folder).expanduser().is_dir() or not folder:
            raise UserError(f"{option}: '{folder}' is no folder; give one with config files")
        _folders.append(str(Path(folder).expanduser().resolve()))
    return rest


class UserConfigs(ConfigSource):
    """A folder of config files in which a class from outside the package has its own schema."""

    def __init__(self, provider: str, path: str) -> None:
        super().__init__(provider, path)
        self._files = FileConfigSource(provider, f"file://{self.path}")

    @staticmethod
    def scheme() -> str:
        return "avn"

    def load_config(self, config_path: str) -> ConfigResult:
        found = self._files.load_config(config_path)
        node, group = found.config, config_path.split("/")[0]
        if isinstance(node, DictConfig):
            if found.header.get("package") == "_global_":
                for own in map(str, list(node)):
                    if is_foreign(own, node[own]):
                        node[own] = with_signature(own, node[own])
            elif is_foreign(group, node):
                found.config = with_signature(group, node)
        return found

    def is_group(self, config_path: str) -> bool:
        return self._files.is_group(config_path)

    def is_config(self, config_path: str) -> bool:
        return self._files.is_config(config_path)

    def available(self) -> bool:
        return self._files.available()

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        return self._files.list(config_path, results_filter)


class UserConfigsPath(SearchPathPlugin):
    """Adds the user's folders to the places where Hydra looks, before ours."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        for folder in _folders:
            search_path.prepend("command-line", f"avn://{folder}")


PLUGINS = (UserConfigs, UserConfigsPath)
