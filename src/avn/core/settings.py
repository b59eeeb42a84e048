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
    hidden = set(ignored) - set(keys)
    return {leaf for key in keys for leaf in _leaves(cfg, key, hidden)}


def _leaves(cfg: DictConfig, key: str, ignored: set[str], below: bool = False) -> Iterator[str]:
    # `below`: the node that the key lies in has been looked at
    if key in ignored:
        return
    for other, hidden in _referred(cfg, key, ignored, below):
        yield from _leaves(cfg, other, hidden)
    value = OmegaConf.select(cfg, key)
    if isinstance(value, DictConfig):
        for child in map(str, value):
            yield from _leaves(cfg, f"{key}.{child}", ignored, below=True)
    elif below or _holds(cfg, key):
        yield key


def _referred(
    cfg: DictConfig, key: str, ignored: set[str], last: bool
) -> Iterator[tuple[str, set[str]]]:
    """What a key refers to, itself or by a node that it lies in, and what is ignored there."""
    parts = key.split(".")
    for count in range(len(parts) if last else 1, len(parts) + 1):
        node = ".".join(parts[:count])
        holder = OmegaConf.select(cfg, ".".join(parts[: count - 1])) if count > 1 else cfg
        if not isinstance(holder, DictConfig) or parts[count - 1] not in holder:
            return
        if OmegaConf.is_interpolation(holder, parts[count - 1]):
            raw: Any = OmegaConf.to_container(holder, resolve=False)
            for other in _REFERENCE.findall(str(raw[parts[count - 1]])):
                moved = {other + own[len(node) :] for own in ignored if own.startswith(f"{node}.")}
                yield other + key[len(node) :], moved


def _holds(cfg: DictConfig, key: str) -> bool:
    parent, _, name = key.rpartition(".")
    holder = OmegaConf.select(cfg, parent) if parent else cfg
    return isinstance(holder, DictConfig) and name in holder
