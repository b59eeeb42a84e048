"""Schemas of config options, derived from the constructors of the classes that they name.

An option names a class with `_target_`. Its schema has the fields of the group's dataclass in
`avn.config.schema.BASES` and the parameters of the class, with their types and defaults. So a
setting is declared once, in the class that uses it, also for classes outside the package.
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

from avn.config.schema import BASES, GIVEN, INTERFACES, LINKED
from avn.config.signature_table import Parameters, known_parameters
from avn.core.classes import check_interface, import_class, parameters
from avn.core.errors import UserError

_PLAIN = (bool, int, float, str)
_TARGET = "_target_"


def is_option(group: str, node: object) -> bool:
    """Return whether a node names a class and its group has a schema."""
    return group in BASES and isinstance(node, DictConfig) and _TARGET in node


def with_signature(group: str, node: DictConfig) -> DictConfig:
    """Return a group's node, typed by the constructor of the class that it names.

    Parameters
    ----------
    group : str
        Name of the config group.
    node : DictConfig
        Option with `_target_`; where that is null, the schema is that of the group.

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
    """Return the node of a submodule that the class builds itself, None where there is none."""
    if OmegaConf.is_missing(typed, key) or OmegaConf.is_interpolation(typed, key):
        return None
    value = typed[key]
    if not isinstance(value, DictConfig) or dataclasses.is_dataclass(OmegaConf.get_type(value)):
        return None
    given = node.get(key)
    # settings of one class do not apply to another
    part = given if isinstance(given, DictConfig) and _TARGET in given else value
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
    """Return the dataclass of an option: fields of the group and parameters of the class.

    Raises
    ------
    UserError
        Where the class cannot be imported, or lacks methods of the base class of the group.
    """
    if target is None:
        return BASES[group]
    if not target.startswith("avn."):  # the package's own classes need not be checked
        option = f"{group}.{_TARGET}"
        base = import_class(option, INTERFACES[group])
        check_interface(option, import_class(option, target), base)
    return _signature(group, target, GIVEN.get(group, ()), BASES[group], linked=True)


def _signature(
    where: str, target: str, given: tuple[str, ...], base: Any = object, linked: bool = False
) -> Any:
    if known_parameters(target) is not None:
        return _built_in(target, given, base, linked)
    cls = import_class(f"{where}.{_TARGET}", target)
    return _imported(cls, target, given, base, linked)


# OmegaConf merges only instances of the same class, so each is made once.


@cache
def _built_in(target: str, given: tuple[str, ...], base: Any, linked: bool) -> Any:
    known = known_parameters(target)
    assert known is not None
    return _settings(known, target, given, base, linked)


@cache
def _imported(cls: Any, target: str, given: tuple[str, ...], base: Any, linked: bool) -> Any:
    return _settings(parameters(cls), target, given, base, linked)


def _settings(
    known: Parameters, target: str, given: tuple[str, ...], base: Any, linked: bool
) -> Any:
    if "cfg" in known and dataclasses.is_dataclass(known["cfg"][0]):
        return known["cfg"][0]  # renderers and backbones take a dataclass
    inherited = {field.name for field in dataclasses.fields(base)} if base is not object else ()
    fields: list[Any] = [
        (name, schema_type(hint), _field(hint, LINKED.get(name, default) if linked else default))
        for name, (hint, default) in known.items()
        if name not in given and (name not in inherited or isinstance(default, _PLAIN))
    ]
    fields.append((_TARGET, str, dataclasses.field(default=target)))
    bases = () if base is object else (base,)
    return dataclasses.make_dataclass(f"{target.split('.')[-1]}Settings", fields, bases=bases)


def _field(hint: Any, default: Any) -> Any:
    nested = schema_type(hint)
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


def schema_type(hint: Any) -> Any:
    """Return a type as OmegaConf supports it, else `Any`."""
    if hint in _PLAIN or dataclasses.is_dataclass(hint):
        return hint
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        known = [kind for argument in arguments if (kind := schema_type(argument)) is not Any]
        if len(known) != 1:
            return Any
        optional = type(None) in arguments and not dataclasses.is_dataclass(known[0])
        return known[0] | None if optional else known[0]
    if typing.get_origin(hint) in (list, Sequence) and arguments and arguments[0] in _PLAIN:
        return list[arguments[0]]  # type: ignore[valid-type]
    return Any
