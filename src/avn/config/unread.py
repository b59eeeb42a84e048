"""Refusal of command-line settings that a command does not read."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from functools import lru_cache
from typing import Any

from hydra import compose
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from omegaconf import DictConfig

from avn.config import option_files, spare
from avn.core.errors import UserError
from avn.core.settings import leaves, plain

# Groups that select what a command does; they may set keys that it does not read.
_CHOOSE = ("agent", "model", "condition", "table", "experiment")
# Settings of the training world that have a default of their own.
_OF_TRAINING = {"sound": "training.sounds", "microphone": "training.microphone"}


def refuse_unread(
    command: str, cfg: DictConfig, read: Collection[str], given: Sequence[str] | None = None
) -> None:
    """Refuse overrides that change settings which the command does not read.

    Parameters
    ----------
    command : str
        Name of the command's config.
    cfg : DictConfig
        Composed config.
    read : collection of str
        Dotted keys of the leaves that the command reads.
    given : sequence of str, optional
        Overrides; those of the command line by default.

    Raises
    ------
    UserError
        For such an override; the message lists the settings that are read.
    """
    for setting in spare.settings() if given is None else ():
        if (key := setting.split("=")[0]) not in read:
            raise _unread(command, key, cfg, read)
    given = list(HydraConfig.get().overrides.task) if given is None else list(given)
    suspects = [
        override
        for override in OverridesParser.create().parse_overrides(given)
        if override.key_or_group not in _CHOOSE
        and not set() < leaves(cfg, [_key(override)]) <= set(read)
    ]
    if not suspects:
        return
    chosen = [override for override in given if override.split("=")[0] in _CHOOSE]
    default = _default(command, *chosen)
    for override in suspects:
        key = _key(override)
        elsewhere = not leaves(cfg, [key])  # sets keys of other nodes, such as debug=overfit
        changed = _changed(cfg, default, [key])
        if not elsewhere and (not changed or changed & set(read)):
            continue
        alone = compose(command, overrides=[*chosen, str(override.input_line)])
        effects = _changed(alone, default, [*alone])
        for unread in sorted(effects - set(read)) if elsewhere else ():
            raise _unread(command, unread, cfg, read)
        # an option may choose one of another group too, as those of `mapper` do
        if effects and not effects & _changed(cfg, default, [*cfg]) & set(read):
            raise _unread(command, key, cfg, read)


def _default(command: str, *chosen: str) -> DictConfig:
    """Compose what is chosen; of the package's own files, whose content stays, once a process."""
    return _composed(command, chosen) if option_files.only_package() else _compose(command, chosen)


def _compose(command: str, overrides: tuple[str, ...]) -> DictConfig:
    return compose(command, overrides=[*overrides])


_composed = lru_cache(maxsize=32)(_compose)


def _changed(cfg: DictConfig, default: DictConfig, keys: Sequence[Any]) -> set[str]:
    """Return the leaves at or below some keys in which two configs differ."""
    found = leaves(cfg, keys) | leaves(default, keys)
    return {leaf for leaf in found if plain(cfg, leaf) != plain(default, leaf)}


def _unread(command: str, key: str, cfg: DictConfig, read: Collection[str]) -> UserError:
    return UserError(
        f"{key}: not read by this run, {_reason(command, key, cfg)}; the run reads "
        f"{', '.join(summary(cfg, read))}"
    )


def _reason(command: str, key: str, cfg: DictConfig) -> str:
    group = key.split(".")[0]
    if command == "train" and (own := _OF_TRAINING.get(group)):
        return f"which trains in the training world; give {own}{key[len(group) :]}"
    node = cfg.get(group)
    if isinstance(node, DictConfig) and "_target_" in node and node["_target_"] is None:
        return f"which has no {group} ({group}={node.get('name', 'none')})"
    return "which does not use it with its other settings"


def _key(override: Override) -> str:
    return str(override.package or override.key_or_group)


def summary(cfg: DictConfig, read: Collection[str]) -> list[str]:
    """Return the settings that are read: whole nodes by name, with their unread keys."""
    return [text for name in sorted(map(str, cfg)) for text in _summary(cfg, name, set(read))]


def _summary(cfg: DictConfig, key: str, read: set[str]) -> Iterable[str]:
    below = {
        leaf
        for leaf in leaves(cfg, [key])
        if leaf == key or leaf.startswith((f"{key}.", f"{key}["))
    }
    known, unread = sorted(below & read), sorted(below - read)
    if known and not unread:
        yield key
    elif len(unread) < len(known):
        yield f"{key} (but for {', '.join(leaf[len(key) + 1 :] for leaf in unread)})"
    else:
        yield from known
