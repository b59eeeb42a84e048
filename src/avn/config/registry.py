"""Registration of schemas and plugins with Hydra."""

from __future__ import annotations

from hydra.core.config_store import ConfigStore
from hydra.core.plugins import Plugins

from avn.config import audio_source, option_files
from avn.config.schema import COMMANDS


def register() -> None:
    """Register schemas and plugins; further calls change nothing."""
    store = ConfigStore.instance()
    for command, schema in COMMANDS.items():
        store.store(name=f"{command}_schema", node=schema)
    for plugin in (*audio_source.PLUGINS, *option_files.PLUGINS):
        Plugins.instance().register(plugin)
