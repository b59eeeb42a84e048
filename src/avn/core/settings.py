"""Settings of a config by dotted key: their values, and which leaves a key stands for."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

from omegaconf import Container, DictConfig, OmegaConf

_REFERENCE = re.compile(r"\$\{([\w.]+)\}")


def typed(node: DictConfig) -> Any:
    """The dataclass instance that a config node of a schema stands for."""
    return OmegaConf.to_object(node)


def values(cfg: DictConfig, keys: Sequence[str], ignored: Sequence[str] = ()) -> list[Any]:
    """Values of some keys, as plain Python; whole nodes lose what is ignored below them.

    Parameters
    ----------
    cfg : DictConfig
    keys : sequence of str
        Dotted keys of nodes or leaves.
    ignored : sequence of str
        Dotted keys of leaves or nodes below them.

    Returns
    -------
    list
        Without the names of `keys`: the same values under two keys are the same.
    """
    return [_without(plain(cfg, key), key, ignored) for key in keys]


def plain(cfg: DictConfig, key: str) -> Any:
    """The value of a dotted key; a node becomes a dict or list, its references resolved."""
    found = OmegaConf.select(cfg, key)
    return OmegaConf.to_container(found, resolve=True) if isinstance(found, Container) else found


def _without(value: Any, key: str, ignored: Sequence[str]) -> Any:
    if not isinstance(value, dict):
        return value
    return {
        name: _without(own, f"{key}.{name}", ignored)
        for name, own in value.items()
        if f"{key}.{name}" not in ignored
    }


def leaves(cfg: DictConfig, keys: Sequence[str], ignored: Sequence[str] = ()) -> set[str]:
    """Dotted keys of all leaves at or below some keys, and of those that they refer to.

    Where `mapper.localisation` is `${localisation}`, reading the one is reading the other.
    """
    return {leaf for key in keys for leaf in _leaves(cfg, key, set(ignored))}


def _leaves(cfg: DictConfig, key: str, ignored: set[str]) -> Iterator[str]:
    if key in ignored:
        return
    parent, _, name = key.rpartition(".")
    holder = OmegaConf.select(cfg, parent) if parent else cfg
    if not isinstance(holder, DictConfig) or name not in holder:
        return
    if OmegaConf.is_interpolation(holder, name):
        raw = str(OmegaConf.to_container(holder, resolve=False)[name])  # type: ignore[index,call-overload]
        for other in _REFERENCE.findall(raw):
            hidden = {f"{other}{own[len(key) :]}" for own in ignored if own.startswith(f"{key}.")}
            yield from _leaves(cfg, other, hidden)
    value = None if OmegaConf.is_missing(holder, name) else holder[name]
    if isinstance(value, DictConfig):
        for child in map(str, value):
            yield from _leaves(cfg, f"{key}.{child}", ignored)
    else:
        yield key
