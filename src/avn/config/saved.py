"""Configs that runs have saved, read back with the schema of each group."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from avn.config import schema
from avn.config.folder import conf_folder
from avn.config.signatures import is_foreign, with_signature
from avn.core.errors import UserError


def read_config(folder: Path) -> DictConfig:
    """The config of a finished run, `outputs/eval/<agent>/<sounds>/<run>/config.yaml`.

    Raises
    ------
    UserError
        Where there is none, or it is not one of this version of avn.
    """
    path = folder.resolve() / "config.yaml"
    if not path.is_file():
        raise UserError(f"{folder}: no run's folder, it has no config.yaml; give one of avn.eval")
    try:
        cfg = _typed(OmegaConf.load(path))
        if len(path.parents) > 4 and path.parents[3].name == "eval":
            cfg.outputs = str(path.parents[4])  # wherever the outputs have been moved to since
    except (OmegaConfBaseException, OSError, ValueError, KeyError, IndexError) as error:
        line = " ".join(str(error).split())
        raise UserError(f"{path}: not a config of this avn ({line}); run avn.eval again") from error
    return cfg


def _typed(plain: Any) -> DictConfig:
    """A config as it was composed, with the schema of each group; what is new has its default."""
    schema.register()
    if GlobalHydra.instance().is_initialized():
        cfg = compose("eval")
    else:
        with initialize_config_dir(str(conf_folder()), version_base="1.3"):
            cfg = compose("eval")
    for key, value in plain.items():
        if isinstance(value, DictConfig) and isinstance(cfg.get(key), DictConfig):
            cfg[key] = _with_schema(str(key), value, cfg[key])
        else:
            cfg[key] = value
    return cfg


def _with_schema(group: str, node: DictConfig, default: DictConfig) -> DictConfig:
    """A group's node with that of its schemas that fits it best: the fewest keys it has not."""
    if is_foreign(group, node):
        return with_signature(group, node)
    if group == "training":
        return _training(node, default)
    found = [schema for (own, _), schema in schema.SCHEMAS.items() if own == group]
    nodes = [OmegaConf.structured(schema) for schema in found]
    fitting = [own for own in nodes if set(map(str, node)) <= set(map(str, own))]
    if not fitting:
        if OmegaConf.get_type(default) is dict:  # of names and paths, which are the file's alone
            return node
        return OmegaConf.merge(default, node)  # type: ignore[return-value]
    best = min(fitting, key=lambda own: (len(own), own._metadata.object_type.__name__))
    return OmegaConf.merge(best, node)  # type: ignore[return-value]


def _training(node: DictConfig, default: DictConfig) -> DictConfig:
    """The node of the training world; its sounds are the file's alone."""
    own = node.copy()
    if is_foreign("microphone", own.get("microphone")):
        own.microphone = with_signature("microphone", own.microphone)
    sounds = own.pop("sounds", default.sounds)
    merged = OmegaConf.merge(default, own)
    OmegaConf.update(merged, "sounds", sounds, merge=False)
    return merged  # type: ignore[return-value]
