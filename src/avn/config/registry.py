"""Registration of schemas and plugins with Hydra."""

from __future__ import annotations

import re

from hydra.core.config_store import ConfigStore
from hydra.core.plugins import Plugins
from omegaconf import OmegaConf

from avn.config import audio_source, option_files
from avn.config.schema import COMMANDS


def row_of_policy(policy: str | None) -> str:
    """Return the name of the row of a policy `module:name`, `module.name`."""
    return re.sub(r"[^\w.-]+", "-", (policy or "external").replace(":", ".")).strip(".")


def register() -> None:
    """Register schemas and plugins; further calls change nothing."""
    OmegaConf.register_new_resolver("row_of_policy", row_of_policy, replace=True)
    store = ConfigStore.instance()
    for command, schema in COMMANDS.items():
        if f"{command}_schema.yaml" not in store.repo:
            store.store(name=f"{command}_schema", node=schema)
    for plugin in (*audio_source.PLUGINS, *option_files.PLUGINS):
        Plugins.instance().register(plugin)
