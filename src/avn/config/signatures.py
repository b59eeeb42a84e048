"""Schemas of classes from outside the package: their own signatures.

An option of a config group names a class with `_target_`. The schema of the group says which keys
every option has; the parameters of the class that come on top are read from its signature, with
their types and defaults. So a class brings its own settings, which are checked as ours are.
"""

from __future__ import annotations

import dataclasses
import inspect
import typing
from typing import Any

from omegaconf import MISSING, DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from avn.config.schema import BASES, GIVEN, LINKED
from avn.core.classes import import_class
from avn.core.errors import UserError

_PLAIN = (bool, int, float, str)


def is_foreign(group: str, node: object) -> bool:
    """Whether a group's node names a class from outside the package."""
    if group not in BASES or not isinstance(node, DictConfig) or "_target_" not in node:
        return False
    target = node["_target_"]
    return isinstance(target, str) and target.split(".")[0] != "avn"


def with_signature(group: str, node: DictConfig) -> DictConfig:
    """A group's node, typed by the signature of the class that it names.

    Parameters
    ----------
    group : str
    node : DictConfig
        With `_target_`.

    Raises
    ------
    UserError
        Where there is no such class, or a key of the node is none of its parameters.
    """
    schema = schema_of(group, str(node["_target_"]))
    try:
        typed = OmegaConf.merge(OmegaConf.structured(schema), node)
    except OmegaConfBaseException as error:
        known = [field.name for field in dataclasses.fields(schema)]
        line = str(error).split("\n")[0]
        raise UserError(f"{group}: {line}; there are {', '.join(known)}") from error
    assert isinstance(typed, DictConfig)
    return typed


def schema_of(group: str, target: str) -> Any:
    """The dataclass of a class's settings: those of its group, and its own parameters.

    Raises
    ------
    UserError
        Where the class cannot be imported.
    """
    cls = import_class(f"{group}._target_", target)
    base = BASES[group]
    own = _parameters(cls)
    if "cfg" in own and dataclasses.is_dataclass(own["cfg"][0]):
        return own["cfg"][0]  # a renderer or a backbone says what its config is
    known = {field.name for field in dataclasses.fields(base)}
    fields = [
        (name, kind, _field(LINKED.get(name, default)))
        for name, (kind, default) in own.items()
        if name not in GIVEN.get(group, ()) and (name not in known or _says(default))
    ]
    fields.append(("_target_", str, dataclasses.field(default=target)))
    return dataclasses.make_dataclass(f"{cls.__name__}Settings", fields, bases=(base,))


def _says(default: Any) -> bool:
    """Whether a class gives a key of its group a default of its own."""
    return isinstance(default, _PLAIN)


def _field(default: Any) -> Any:
    if default is inspect.Parameter.empty:
        return dataclasses.field(default=MISSING)
    if isinstance(default, list | dict | tuple | set):
        plain = list(default) if isinstance(default, tuple | set) else default
        return dataclasses.field(default_factory=lambda: plain.copy())
    return dataclasses.field(default=default)


def _parameters(cls: type) -> dict[str, tuple[Any, Any]]:
    """Type and default of each parameter, those that `**` hands on to a base class included."""
    found: dict[str, tuple[Any, Any]] = {}
    for owner in cls.__mro__:
        if "__init__" not in vars(owner) or owner is object:
            continue
        hints = _hints(owner.__init__)  # type: ignore[misc]
        parameters = list(inspect.signature(owner.__init__).parameters.values())[1:]  # type: ignore[misc]
        for own in parameters:
            if own.kind in (own.POSITIONAL_OR_KEYWORD, own.KEYWORD_ONLY):
                found.setdefault(own.name, (_kind(hints.get(own.name)), own.default))
        if not any(own.kind is own.VAR_KEYWORD for own in parameters):
            break
    return found


def _hints(function: Any) -> dict[str, Any]:
    try:
        return typing.get_type_hints(function)
    except (NameError, TypeError):  # names that are imported for type checkers alone
        return {}


def _kind(hint: Any) -> Any:
    """The type as a config can hold it; anything where it is no plain one."""
    if hint in _PLAIN or dataclasses.is_dataclass(hint):
        return hint
    arguments = typing.get_args(hint)
    if type(None) in arguments and len(arguments) == 2:
        inner = _kind(next(own for own in arguments if own is not type(None)))
        return inner | None if inner is not Any else Any
    if typing.get_origin(hint) is list and arguments and arguments[0] in _PLAIN:
        return hint
    return Any
