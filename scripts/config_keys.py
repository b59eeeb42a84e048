"""All config keys with their types, defaults and meanings, from composed configs."""

from __future__ import annotations

import dataclasses
import json
import re
import typing
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from config_meanings import comments, described, summary_of, target_of
from config_readers import composed, in_rounds, options_of
from hydra import initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig, OmegaConf

from avn.config import registry
from avn.config.folder import conf_folder

COMMANDS = ("eval", "train", "generate", "reproduce")
# Values that a docstring names, as in `goal : {"box", "radius"}`.
_CHOICE = re.compile(r'"([^"]*)"')
_HYDRA = ("_target_", "_recursive_", "_convert_", "_partial_")


@dataclass(frozen=True)
class Key:
    """A config key of one option."""

    name: str
    kind: str
    default: str
    meaning: str
    choices: tuple[str, ...] = ()


@dataclass
class Group:
    """A config group, or the keys of a command.

    Attributes
    ----------
    name : str
    options : dict of str to str
        Description of each option; none for the keys of a command.
    keys : dict of str to dict of str to Key
        The keys of each option, by name.
    """

    name: str
    options: dict[str, str]
    keys: dict[str, dict[str, Key]] = field(default_factory=dict)


@contextmanager
def composing() -> Iterator[None]:
    """Make `hydra.compose` compose configs of this package."""
    GlobalHydra.instance().clear()
    registry.register()
    with initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"):
        yield


def groups() -> list[Group]:
    """List all config groups, in the order of a config, then `agent` and `model`."""
    found = []
    folders = {folder.name for folder in conf_folder().iterdir() if folder.is_dir()}
    own = [name for name in map(str, composed("eval")) if name in folders - {"agent", "model"}]
    configs = [composed("eval", *chosen) for chosen in in_rounds({n: options_of(n) for n in own})]
    configs += [composed("eval", f"agent={row}") for row in options_of("agent")]
    configs += [composed("train", f"model={model}") for model in options_of("model")]
    for name in (*own, "agent", "model"):
        options: dict[str, str] = {}
        group = Group(name, options)
        for option in options_of(name):
            # the first one that chooses it: rows come later, and change settings of options
            choosing = (own for own in configs if own.hydra.runtime.choices.get(name) == option)
            cfg = next(choosing)
            file = conf_folder() / name / f"{option}.yaml"
            target = target_of(cfg[name]) if isinstance(cfg[name], DictConfig) else ""
            options[option] = comments(file).get("", "") or (summary_of(target) if target else "")
            group.keys[option] = {key.name: key for key in _keys(cfg, name, [file])}
        _share_meanings(group)
        found.append(group)
    return found


def commands(known: set[str]) -> list[Group]:
    """List the keys outside of groups: those of all commands, then those of each.

    Parameters
    ----------
    known : set of str
        Names of the groups.
    """
    found = {}
    for command in COMMANDS:
        cfg = composed(command, *(["model=sound_cnn"] if command == "train" else []))
        files = [conf_folder() / f"{command}.yaml", conf_folder() / "_core.yaml"]
        own = [name for name in map(str, cfg) if name not in {*known, "hydra"}]
        found[command] = {key.name: key for name in own for key in _keys(cfg, name, files)}
    shared = set.intersection(*map(set, found.values()))
    every = {name: key for name, key in found["eval"].items() if name in shared}
    return [
        Group("Every command", {}, {"": every}),
        *(
            Group(f"avn.{command}", {}, {"": {n: k for n, k in own.items() if n not in shared}})
            for command, own in found.items()
            if set(own) - shared
        ),
    ]


def _keys(holder: DictConfig, name: str, files: list[Path], path: str = "") -> Iterator[Key]:
    """Yield a key of a node, or the keys below it if it is a node of settings."""
    node: Any = holder._get_node(name)
    dotted = f"{path}{name}"
    if _has_settings(node):
        for child in map(str, node):
            if child not in _HYDRA:
                yield from _keys(node, child, files, f"{dotted}.")
        return
    kind, meaning = described(holder, name)
    if not meaning:
        beside = (comments(file).get(key) for file in files for key in (dotted, _below(dotted)))
        meaning = next((text for text in beside if text), "")
    raw = OmegaConf.to_container(holder, resolve=False)
    assert isinstance(raw, dict)
    yield Key(dotted, _kind(node), _value(raw[name]), meaning, tuple(_CHOICE.findall(kind)))


def _below(dotted: str) -> str:
    """Return a key as in the file of its option, without the group."""
    return dotted.partition(".")[2] or dotted


def _has_settings(node: Any) -> bool:
    """Return True for a node of settings, False for a mapping whose keys are the user's."""
    if not isinstance(node, DictConfig) or node._is_interpolation() or node._is_missing():
        return False
    of_any = node._metadata.element_type in (Any, None)
    return (
        not node._is_none() and (OmegaConf.get_type(node) is not dict or of_any) and len(node) > 0
    )


def _kind(node: Any) -> str:
    """Return the type of a node: that of its schema, else that of its value."""
    declared = node._metadata.ref_type
    if dataclasses.is_dataclass(declared):
        return "settings"
    if declared is Any and not node._is_interpolation():
        declared = type(node._value())
    name = _type_name(declared)
    return f"{name} or null" if node._metadata.optional and name not in ("any", "null") else name


def _type_name(declared: Any) -> str:
    arguments = typing.get_args(declared)
    name = {Any: "any", type(None): "null"}.get(declared) or declared.__name__.lower()
    return f"{name}[{', '.join(map(_type_name, arguments))}]" if arguments else name


def _value(raw: Any) -> str:
    """Format a value as on the command line."""
    if raw == "???":
        return "???"
    if isinstance(raw, dict):
        return f"{{{', '.join(f'{name}: {_value(own)}' for name, own in raw.items())}}}"
    if isinstance(raw, list):
        return f"[{', '.join(map(_value, raw))}]"
    return raw if isinstance(raw, str) and raw else json.dumps(raw)


def _share_meanings(group: Group) -> None:
    """Give a key that one option does not describe the description of another."""
    texts: dict[str, Key] = {}
    for own in group.keys.values():
        for name, key in own.items():
            if key.meaning:
                texts.setdefault(name, key)
    for own in group.keys.values():
        for name, key in own.items():
            if not key.meaning and name in texts:
                own[name] = replace(key, meaning=texts[name].meaning, choices=texts[name].choices)


def gaps(found: list[Group]) -> list[str]:
    """List keys without a meaning, and options without a description."""
    options = [f"{g.name}={name}" for g in found for name, text in g.options.items() if not text]
    keys = {k.name for g in found for own in g.keys.values() for k in own.values() if not k.meaning}
    return options + sorted(keys)
