"""Meanings of config keys: from docstrings of classes, else from comments of config files.

A key is described where its node's class is: in the section `Attributes` or `Parameters` of the
dataclass that is its schema, or of the class that its `_target_` names. A key without such a
description has that of the comment beside it, or above it, in a config file.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

_SECTIONS = ("Parameters", "Attributes")
_ENTRY = re.compile(r"(\w+(?:, \w+)*)(?: : (.*))?")
_REFERRAL = re.compile(r"(?:See|As those of) `([\w.]+)`\.?")
_KEY = re.compile(r"( *)(\w+):(.*)")
_COMMENT = re.compile(r"(?:^|\s)#\s*(.*)$")


def described(node: DictConfig, name: str) -> tuple[str, str]:
    """Return type and meaning of a key from the docstrings of its node's classes.

    Either is empty if no docstring has it.
    """
    return _first(_classes(node), name)


def target_of(node: DictConfig) -> str:
    """Return the name of the class of a node; empty if it has none."""
    raw: Any = OmegaConf.to_container(node, resolve=False)
    return str(raw.get("_target_") or "")


def summary_of(target: str) -> str:
    """Return the first line of the docstring of the object of a dotted name."""
    return (inspect.getdoc(_imported(target)) or "").split("\n")[0]


def _classes(node: DictConfig) -> Iterator[object]:
    """Return the dataclass of a node and the class that it names, each with its base classes."""
    for found in (OmegaConf.get_type(node), _imported(target_of(node))):
        yield from _with_bases(found)


def _with_bases(found: object) -> tuple[object, ...]:
    return found.__mro__ if isinstance(found, type) else (found,)


def _first(owners: Iterable[object], name: str) -> tuple[str, str]:
    """Return type and meaning of a key from the first docstring that has it."""
    return next((own for own in (_entry(owner, name) for owner in owners) if own[1]), ("", ""))


def _imported(target: str) -> object:
    """Import the object of a dotted name; return None if its package is not installed."""
    module, _, name = target.rpartition(".")
    if not module:
        return None
    try:
        return getattr(importlib.import_module(module), name, None)
    except ImportError:
        return None


@cache
def _entry(owner: object, name: str) -> tuple[str, str]:
    for described in (owner, vars(owner).get("__init__") if isinstance(owner, type) else None):
        found = _entries(getattr(described, "__doc__", None) or "").get(name)
        if found and (referral := _REFERRAL.fullmatch(found[2])):
            module = getattr(owner, "__module__", "")
            other = _imported(referral[1]) or _imported(f"{module}.{referral[1]}")
            return _first(_with_bases(other), name)
        if found and found[2]:
            names, kind, text = found
            others = ", ".join(f"`{own}`" for own in names) + ": " if len(names) > 1 else ""
            return kind, f"{others}{text}"
    return "", ""


@cache
def _entries(docstring: str) -> dict[str, tuple[list[str], str, str]]:
    """Map each name in a numpydoc docstring to all names of its entry, their type, and the text."""
    found: dict[str, tuple[list[str], str, str]] = {}
    section = ""
    names: list[str] = []
    lines = inspect.cleandoc(docstring).split("\n")
    for line, following in zip(lines, [*lines[1:], ""], strict=True):
        if following and set(following) == {"-"}:
            section, names = line, []
        elif section not in _SECTIONS or (line and set(line) == {"-"}):
            continue
        elif line and not line.startswith(" "):
            entry = _ENTRY.fullmatch(line)
            names = entry[1].split(", ") if entry else []
            found |= dict.fromkeys(names, (names, entry[2] or "" if entry else "", ""))
        elif line:
            for name in names:
                kind, text = found[name][1:]
                found[name] = names, kind, f"{text} {line.strip()}".strip()
    return found


@cache
def comments(path: Path) -> dict[str, str]:
    """Read the comment of each dotted key of a YAML file, and under "" that of the file itself."""
    found: dict[str, str] = {}
    above: list[str] = []
    parents: list[tuple[int, str]] = []
    for line in path.read_text().splitlines():
        bare = line.strip()
        if bare.startswith("#"):
            above += [] if "@package" in bare else [bare.lstrip("# ")]
            continue
        if (above or bare) and "" not in found:
            found[""] = " ".join(above)
        if key := _KEY.fullmatch(line):
            parents = [own for own in parents if own[0] < len(key[1])]
            parents.append((len(key[1]), key[2]))
            beside = _COMMENT.search(key[3])
            dotted = ".".join(name for _, name in parents)
            found[dotted] = beside[1] if beside else " ".join(above)
        above = []
    return found
