"""Refuses settings of the command line that nothing of a command reads."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from hydra import compose
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from omegaconf import DictConfig

from avn.config import spare
from avn.core.errors import UserError
from avn.core.settings import leaves, plain

# Groups that choose what a command does; the defaults of their options are no one's mistake.
_CHOOSE = ("agent", "model", "experiment")


def refuse_unread(command: str, cfg: DictConfig, read: Collection[str]) -> None:
    """Refuse overrides that change settings which the command does not read.

    Parameters
    ----------
    command : str
        The name of its config.
    cfg : DictConfig
    read : collection of str
        Dotted keys of the leaves that it reads.

    Raises
    ------
    UserError
        Naming the override, and all settings that are read.
    """
    for setting in spare.settings():
        if (key := setting.split("=")[0]) not in read:
            raise _unread(key, cfg, read)
    given = list(HydraConfig.get().overrides.task)
    suspects = [
        override
        for override in OverridesParser.create().parse_overrides(given)
        if override.key_or_group not in _CHOOSE and not leaves(cfg, [_key(override)]) <= set(read)
    ]
    if not suspects:
        return
    chosen = [own for own in given if own.split("=")[0] in _CHOOSE]
    default = compose(command, overrides=chosen)
    for override in suspects:
        key = _key(override)
        here, there = leaves(cfg, [key]), leaves(default, [key])
        changed = {leaf for leaf in here | there if plain(cfg, leaf) != plain(default, leaf)}
        if changed and not changed & set(read):
            raise _unread(key, cfg, read)


def _unread(key: str, cfg: DictConfig, read: Collection[str]) -> UserError:
    return UserError(
        f"{key}: not read by this run, so that it would change nothing; the run reads "
        f"{', '.join(summary(cfg, read))}"
    )


def _key(override: Override) -> str:
    return str(override.package or override.key_or_group)


def summary(cfg: DictConfig, read: Collection[str]) -> list[str]:
    """The settings that are read: whole nodes by their name, with what is left out of them."""
    return [text for name in sorted(map(str, cfg)) for text in _summary(cfg, name, set(read))]


def _summary(cfg: DictConfig, key: str, read: set[str]) -> Iterable[str]:
    every = {leaf for leaf in leaves(cfg, [key]) if leaf == key or leaf.startswith(f"{key}.")}
    here, others = sorted(every & read), sorted(every - read)
    if here and not others:
        yield key
    elif len(others) < len(here):
        yield f"{key} (but for {', '.join(leaf[len(key) + 1 :] for leaf in others)})"
    else:
        yield from here
