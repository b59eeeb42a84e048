"""Settings of a config by dotted key: their values, and the leaves below a key."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

from omegaconf import Container, DictConfig, OmegaConf

_REFERENCE = re.compile(r"\$\{([\w.]+)\}")


def typed(node: DictConfig) -> Any:
    """Convert a config node of a schema to an instance of its dataclass."""
    return OmegaConf.to_object(node)


def values(cfg: DictConfig, keys: Sequence[str], ignored: Sequence[str] = ()) -> list[Any]:
    """Return the values of some keys as plain Python objects, without the ignored ones.

    Parameters
    ----------
    cfg : DictConfig
        The config.
    keys : sequence of str
        Dotted keys of nodes or leaves.
    ignored : sequence of str
        Dotted keys of leaves or nodes below them, to leave out.

    Returns
    -------
    list
        Values in the order of `keys`, without their names.
    """
    return [_without(plain(cfg, key), key, ignored) for key in keys]


def plain(cfg: DictConfig, key: str) -> Any:
    """Return the value of a dotted key; a node becomes a dict or list, its references resolved."""
    value = OmegaConf.select(cfg, key)
    return OmegaConf.to_container(value, resolve=True) if isinstance(value, Container) else value


def _without(value: Any, key: str, ignored: Sequence[str]) -> Any:
    if not isinstance(value, dict):
        return value
    return {
        name: _without(child, f"{key}.{name}", ignored)
        for name, child in value.items()
        if f"{key}.{name}" not in ignored
    }


def leaves(cfg: DictConfig, keys: Sequence[str], ignored: Sequence[str] = ()) -> set[str]:
    """Return the dotted keys of all leaves at or below some keys, and of those they refer to.

    If `mapper.localisation` is `${localisation}`, the leaves of both are returned. A node without
    keys is a leaf.

    Parameters
    ----------
    cfg : DictConfig
        The config.
    keys : sequence of str
        Dotted keys of nodes or leaves.
    ignored : sequence of str
        Dotted keys of leaves or nodes to leave out, unless they are in `keys`.
    """
    hidden = set(ignored) - set(keys)
    return {leaf for key in keys for leaf in _leaves(cfg, key, hidden)}


def _leaves(cfg: DictConfig, key: str, ignored: set[str]) -> Iterator[str]:
    if key in ignored:
        return
    for other, hidden in _referred(cfg, key, ignored):
        yield from _leaves(cfg, other, hidden)
    value = OmegaConf.select(cfg, key)
    if isinstance(value, DictConfig) and len(value):
        yield from _below(cfg, key, value, ignored)
    elif _holds(cfg, key):
        yield key


def _below(cfg: DictConfig, key: str, node: DictConfig, ignored: set[str]) -> Iterator[str]:
    """Yield the leaves of a node, and of those that they refer to. `key` is the node's own."""
    for name in node:
        child = below_key(key, str(name))
        if child in ignored:
            continue
        for other, hidden in _references(node, name, child, ignored):
            yield from _leaves(cfg, other, hidden)
        value = None if OmegaConf.is_missing(node, name) else node[name]
        if isinstance(value, DictConfig) and len(value):
            yield from _below(cfg, child, value, ignored)
        else:
            yield child


def below_key(key: str, child: str) -> str:
    """Return the dotted key of a child, in brackets where its own name has dots."""
    return f"{key}[{child}]" if "." in child else f"{key}.{child}"


def _referred(cfg: DictConfig, key: str, ignored: set[str]) -> Iterator[tuple[str, set[str]]]:
    """Yield the keys that a key or a node above it refers to, each with the keys ignored there."""
    parts = key.split(".")
    for count in range(1, len(parts) + 1):
        node = ".".join(parts[:count])
        holder = OmegaConf.select(cfg, ".".join(parts[: count - 1])) if count > 1 else cfg
        # `in holder` would follow the reference
        if not isinstance(holder, DictConfig) or parts[count - 1] not in holder.keys():  # noqa: SIM118
            return
        for other, moved in _references(holder, parts[count - 1], node, ignored):
            yield other + key[len(node) :], moved


def _references(
    holder: DictConfig, name: Any, key: str, ignored: set[str]
) -> Iterator[tuple[str, set[str]]]:
    """Yield the keys that one value refers to, each with the keys ignored there."""
    if OmegaConf.is_interpolation(holder, name):
        raw = holder._get_node(name)._value()  # type: ignore[union-attr]
        for other in _REFERENCE.findall(str(raw)):
            yield other, {other + k[len(key) :] for k in ignored if k.startswith(f"{key}.")}


def _holds(cfg: DictConfig, key: str) -> bool:
    parent, _, name = key.rpartition(".")
    holder = OmegaConf.select(cfg, parent) if parent else cfg
    return isinstance(holder, DictConfig) and name in holder
