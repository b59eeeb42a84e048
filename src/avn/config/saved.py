"""Configs that runs have saved, read with the schema of each group."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from hydra import compose
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from avn.config import schema
from avn.config.python import composing
from avn.config.signatures import is_option, with_signature
from avn.core.errors import UserError

# Errors of reading a file that is damaged, or of another version.
_DAMAGE = (
    *(OmegaConfBaseException, yaml.YAMLError, UserError),
    *(OSError, ValueError, KeyError, IndexError),
)


def read_config(folder: Path) -> DictConfig:
    """Read the config of a finished run, `outputs/eval/<agent>/<sounds>/<run>/config.yaml`.

    Raises
    ------
    UserError
        Where there is none, or it does not fit this version of avn.
    """
    path = folder.resolve() / "config.yaml"
    if not path.is_file():
        raise UserError(f"{folder}: no run's folder, it has no config.yaml; give one of avn.eval")
    try:
        cfg = _typed(OmegaConf.load(path))
        if len(path.parents) > 4 and path.parents[3].name == "eval":
            cfg.outputs = str(path.parents[4])  # the outputs may have been moved since
    except _DAMAGE as error:
        line = " ".join(str(error).split())
        raise UserError(f"{path}: not a config of this avn ({line}); run avn.eval again") from error
    return cfg


def _typed(plain: Any) -> DictConfig:
    """Return a saved config with the schema of each group; new keys have their defaults."""
    with composing():
        cfg = compose("eval")
    for key, value in plain.items():
        if isinstance(value, DictConfig) and isinstance(cfg.get(key), DictConfig):
            cfg[key] = _with_schema(str(key), value, cfg[key])
        else:
            cfg[key] = value
    return cfg


def _with_schema(group: str, node: DictConfig, default: DictConfig) -> DictConfig:
    """Return a group's node with its schema."""
    if is_option(group, node):
        return with_signature(group, node)
    if group == "training":
        return _training(node, default)
    if group in schema.SCHEMAS:
        return OmegaConf.merge(OmegaConf.structured(schema.SCHEMAS[group]), node)  # type: ignore
    if OmegaConf.get_type(default) is dict:  # sounds: the defaults are not merged in
        return node
    return OmegaConf.merge(default, node)  # type: ignore[return-value]


def _training(node: DictConfig, default: DictConfig) -> DictConfig:
    """Return the node of the training world; default sounds are not merged into its sounds."""
    node, merged = node.copy(), default.copy()
    for key in ("microphone", "sounds"):
        value = node.pop(key, default[key])
        typed = with_signature(key, value) if is_option(key, value) else value
        OmegaConf.update(merged, key, typed, merge=False)
    return OmegaConf.merge(merged, node)  # type: ignore[return-value]
