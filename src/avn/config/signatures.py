"""Schemas of the options of config groups, read from the signatures of the classes they name.

An option names a class with `_target_`. What every option of its group has is a dataclass in
`avn.config.schema.BASES`; the parameters of the class come on top, with their types and defaults.
So a setting stands in one place, the class that uses it, and a class from outside the package
brings its own.
"""

from __future__ import annotations

import copy
import dataclasses
import inspect
import types
import typing
from collections.abc import Sequence
from functools import cache
from typing import Any

from omegaconf import MISSING, DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from avn.config.schema import BASES, GIVEN, LINKED
from avn.core.classes import import_class, parameters
from avn.core.errors import UserError

_PLAIN = (bool, int, float, str)
_TARGET = "_target_"


def is_option(group: str, node: object) -> bool:
    """Whether a node is one of a group that has a schema, and says which class it is of."""
    return group in BASES and isinstance(node, DictConfig) and _TARGET in node


def with_signature(group: str, node: DictConfig) -> DictConfig:
    """A group's node, typed by the signature of the class that it names.

    Parameters
    ----------
    group : str
    node : DictConfig
        With `_target_`, which may be null: then it has what every option of the group has.

    Raises
    ------
    UserError
        Where there is no such class, or a key of the node is none of its parameters.
    """
    schema = schema_of(group, node[_TARGET])
    typed = _merged(group, schema, node)
    for key in map(str, typed):
        if (part := _part(typed, node, key)) is not None:
            where = f"{group}.{key}"
            typed[key] = _merged(where, _signature(where, part[_TARGET], GIVEN.get(key, ())), part)
    return typed


def _part(typed: DictConfig, node: DictConfig, key: str) -> DictConfig | None:
    """The node of a part that the class builds itself, where it names the part's class."""
    if OmegaConf.is_missing(typed, key) or OmegaConf.is_interpolation(typed, key):
        return None
    value = typed[key]
    if not isinstance(value, DictConfig) or dataclasses.is_dataclass(OmegaConf.get_type(value)):
        return None
    own = node.get(key)
    # what is given for one class means nothing to another
    part = own if isinstance(own, DictConfig) and _TARGET in own else value
    return part if _TARGET in part else None


def _merged(where: str, schema: Any, node: DictConfig) -> DictConfig:
    try:
        typed = OmegaConf.merge(OmegaConf.structured(schema), node)
    except OmegaConfBaseException as error:
        known = [field.name for field in dataclasses.fields(schema)]
        line = str(error).split("\n")[0]
        raise UserError(f"{where}: {line}; there are {', '.join(known)}") from error
    assert isinstance(typed, DictConfig)
    return typed


def schema_of(group: str, target: str | None) -> Any:
    """The dataclass of an option: what every option of the group has, and the class's parameters.

    Raises
    ------
    UserError
        Where the class cannot be imported.
    """
    if target is None:
        return BASES[group]
    return _signature(group, target, GIVEN.get(group, ()), BASES[group], linked=True)


def _signature(
    where: str, target: str, given: tuple[str, ...], base: Any = object, linked: bool = False
) -> Any:
    cls = import_class(f"{where}.{_TARGET}", target)
    return _settings(cls, target, given, base, linked)


@cache  # merging wants the same class for the same settings
def _settings(cls: Any, target: str, given: tuple[str, ...], base: Any, linked: bool) -> Any:
    own = parameters(cls)
    if "cfg" in own and dataclasses.is_dataclass(own["cfg"][0]):
        return own["cfg"][0]  # a renderer or a backbone says what its config is
    inherited = {field.name for field in dataclasses.fields(base)} if base is not object else ()
    fields: list[Any] = [
        (name, _kind(hint), _field(hint, LINKED.get(name, default) if linked else default))
        for name, (hint, default) in own.items()
        if name not in given and (name not in inherited or isinstance(default, _PLAIN))
    ]
    fields.append((_TARGET, str, dataclasses.field(default=target)))
    bases = () if base is object else (base,)
    return dataclasses.make_dataclass(f"{cls.__name__}Settings", fields, bases=bases)


def _field(hint: Any, default: Any) -> Any:
    nested = _kind(hint)
    if isinstance(default, list | dict | tuple | set):
        plain = list(default) if isinstance(default, tuple | set) else default
        return dataclasses.field(default_factory=lambda: plain.copy())
    if isinstance(default, _PLAIN) or (default is None and not dataclasses.is_dataclass(nested)):
        return dataclasses.field(default=default)
    if dataclasses.is_dataclass(nested):
        made = default if dataclasses.is_dataclass(default) else nested()  # type: ignore[operator]
        return dataclasses.field(default_factory=lambda: copy.deepcopy(made))
    if default is inspect.Parameter.empty:
        return dataclasses.field(default=MISSING)
    return dataclasses.field(default=default)


def _kind(hint: Any) -> Any:
    """The type as a config can hold it; anything where it is no plain one."""
    if hint in _PLAIN or dataclasses.is_dataclass(hint):
        return hint
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        known = [kind for own in arguments if (kind := _kind(own)) is not Any]
        if len(known) != 1:
            return Any
        optional = type(None) in arguments and not dataclasses.is_dataclass(known[0])
        return known[0] | None if optional else known[0]
    if typing.get_origin(hint) in (list, Sequence) and arguments and arguments[0] in _PLAIN:
        return list[arguments[0]]  # type: ignore[valid-type]
    return Any
