"""Table of the constructors of built-in classes, so that a config is composed without torch.

`signatures.json` holds the parameters of each class that an option of the package names. An entry
counts only while the source files of the class and of its bases have the hashes that it holds;
otherwise the class is imported. `scripts/signature_table.py` writes the table.
"""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
import inspect
import json
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parents[1]
TABLE = Path(__file__).with_name("signatures.json")
# Type and default of each parameter by name, as of `avn.core.classes.parameters`.
Parameters = Mapping[str, tuple[Any, Any]]

_PLAIN = {"bool": bool, "int": int, "float": float, "str": str, "Any": Any}
_OPTIONAL = " | None"


def known_parameters(target: str) -> Parameters | None:
    """Return the parameters of a built-in class, None where the table has no valid entry.

    Parameters
    ----------
    target : str
        Module and name of the class.
    """
    entry = _table().get(target)
    if entry is None or any(_hash(name) != digest for name, digest in entry["files"].items()):
        return None
    return {name: _decode(*described) for name, *described in entry["parameters"]}


@cache
def _table() -> dict[str, Any]:
    table: dict[str, Any] = json.loads(TABLE.read_text())
    return table


@cache
def _hash(module: str) -> str:
    path = PACKAGE.parent / f"{module.replace('.', '/')}.py"
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def _decode(kind: str, default: Any = inspect.Parameter.empty) -> tuple[Any, Any]:
    hint = _type(kind)
    if dataclasses.is_dataclass(hint) and isinstance(default, dict):
        default = hint(**default)  # type: ignore[operator]
    return hint, default


def _type(kind: str) -> Any:
    if kind.endswith(_OPTIONAL):
        return _type(kind.removesuffix(_OPTIONAL)) | None
    if kind.startswith("list["):
        return list[_type(kind[5:-1])]  # type: ignore[misc]
    if kind in _PLAIN:
        return _PLAIN[kind]
    module, _, name = kind.partition(":")
    return getattr(importlib.import_module(module), name)


def table_text(targets: Iterable[str], kind: Callable[[Any], Any]) -> str:
    """Return the content of the table, as of the imported classes.

    Parameters
    ----------
    targets : iterable of str
        Classes of the package.
    kind : callable
        Function from a type to that of a schema, `avn.config.signatures.schema_type`.
    """
    entries = {target: _entry(target, kind) for target in sorted(set(targets))}
    return json.dumps(entries, indent=1) + "\n"


def _entry(target: str, kind: Callable[[Any], Any]) -> dict[str, Any]:
    from avn.core.classes import import_class, parameters

    cls = import_class("_target_", target)
    modules = [base.__module__ for base in cls.__mro__ if base.__module__.split(".")[0] == "avn"]
    return {
        "files": {module: _hash(module) for module in sorted(set(modules))},
        "parameters": [
            [name, _text(kind(hint)), *_default(default)]
            for name, (hint, default) in parameters(cls).items()
        ],
    }


def _text(kind: Any) -> str:
    if dataclasses.is_dataclass(kind):
        return f"{kind.__module__}:{kind.__qualname__}"  # type: ignore[union-attr]
    return "Any" if kind is Any else kind.__name__ if isinstance(kind, type) else str(kind)


def _default(default: Any) -> list[Any]:
    if default is inspect.Parameter.empty:
        return []
    if dataclasses.is_dataclass(default) and not isinstance(default, type):
        return [dataclasses.asdict(default)]
    return [list(default) if isinstance(default, tuple | set) else default]
