"""Import of the classes that a config names, their parameters, and construction of objects."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import typing
from typing import Any

from hydra.errors import InstantiationException
from hydra.utils import instantiate
from omegaconf import Container, DictConfig, OmegaConf

from avn.core.errors import UserError


def import_class(option: str, target: str) -> Any:
    """Import the class that a config names.

    Parameters
    ----------
    option : str
        Key of the config, for the message.
    target : str
        Module and class, such as `avn.views.raycast.Raycast`.

    Raises
    ------
    UserError
        If it cannot be imported.
    """
    module, _, name = target.rpartition(".")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise UserError(
            f"{option}: '{target}' cannot be had ({error}); is its folder on PYTHONPATH?"
        ) from error


def check_interface(option: str, cls: Any, base: type) -> None:
    """Refuse a class that lacks methods of the base class of its kind.

    Parameters
    ----------
    option : str
        Key of the config that names the class, for the message.
    cls : object
        What was imported.
    base : type
        Base class of the kind. `cls` need not be derived from it.

    Raises
    ------
    UserError
        If `cls` is no class, lacks a public method of `base`, or leaves one abstract.
    """
    advice = f"derive it from {base.__module__}.{base.__qualname__}"
    if not isinstance(cls, type):
        what = getattr(cls, "__qualname__", repr(cls))
        raise UserError(f"{option}: {what} is a {type(cls).__name__} and no class; {advice}")
    package = __name__.split(".")[0]
    owners = [owner for owner in base.__mro__ if owner.__module__.split(".")[0] == package]
    methods = {
        name
        for owner in owners
        for name, value in vars(owner).items()
        if not name.startswith("_")
        and (callable(value) or isinstance(value, property | classmethod | staticmethod))
    }
    missing = sorted(
        {name for name in methods if not hasattr(cls, name)}
        | set(getattr(cls, "__abstractmethods__", ()))
    )
    if missing:
        raise UserError(
            f"{option}: class {cls.__module__}.{cls.__qualname__} lacks {', '.join(missing)}; "
            f"{advice}{'' if not issubclass(cls, base) else ' and define them'}"
        )


def parameters(cls: type) -> dict[str, tuple[Any, Any]]:
    """Return the type and default of each parameter of a class, by name.

    Parameters that `**` passes on to a base class are among them; those of the class itself have
    precedence. `inspect.Parameter.empty` stands for no default.
    """
    described: dict[str, tuple[Any, Any]] = {}
    for owner in cls.__mro__:
        if "__init__" not in vars(owner) or owner is object:
            continue
        # names in a dataclass's annotations are of the modules of its bases
        data = dataclasses.is_dataclass(owner)
        hints = _hints(owner if data else owner.__init__)  # type: ignore[misc]
        taken = list(inspect.signature(owner.__init__).parameters.values())[1:]  # type: ignore[misc]
        for each in taken:
            if each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY):
                default = _field_default(owner, each.name) if data else each.default
                described.setdefault(each.name, (hints.get(each.name), default))
        if not any(each.kind is each.VAR_KEYWORD for each in taken):
            break
    return described


def _field_default(cls: Any, name: str) -> Any:
    """Return the default of a dataclass's field."""
    field = cls.__dataclass_fields__[name]
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return inspect.Parameter.empty if field.default is dataclasses.MISSING else field.default


def _hints(function: Any) -> dict[str, Any]:
    try:
        return typing.get_type_hints(function)
    except (NameError, TypeError):  # names that are imported for type checkers alone
        return {}


def build_object(option: str, node: DictConfig, **given: Any) -> Any:
    """Build the object that a node of the config describes.

    Keys that are no parameters of its class, such as the `name` of an option, are left out. Nodes
    below it become objects of their own class, or plain dicts if the class takes dicts.

    Parameters
    ----------
    option : str
        Key of the node, for messages.
    node : DictConfig
        Settings with `_target_`.
    **given
        Arguments that are not in the config; those that the class does not take are left out.

    Raises
    ------
    UserError
        If there is no such class, or the class rejects a value.
    """
    target = str(node["_target_"])
    cls = import_class(f"{option}._target_", target)
    taken = parameters(cls)
    settings = {key: _value(node[key], taken[key][0]) for key in map(str, node) if key in taken}
    return cls(**settings, **{key: value for key, value in given.items() if key in taken})


def _value(value: Any, hint: Any) -> Any:
    """Convert a setting to the type of its parameter: nodes to dataclasses, or to plain dicts.

    Networks take dicts, which can be stored in checkpoints.
    """
    if not isinstance(value, Container):
        return value
    kinds = (hint, *typing.get_args(hint))
    plain = any(kind is dict or typing.get_origin(kind) is dict for kind in kinds)
    if isinstance(value, DictConfig) and not plain:
        return OmegaConf.to_object(value)
    return OmegaConf.to_container(value, resolve=True)


def build_part(config: Any, node: str = "", **given: Any) -> Any:
    """Build a part of a network from its config.

    Parameters
    ----------
    config : config or dict
        Settings with `_target_`.
    node : str
        Node of the config that holds the part, such as `sound_model`, for messages.
    **given
        Further arguments.

    Raises
    ------
    UserError
        If the part raises it; the node is put before the message.
    """
    try:
        return instantiate(config, **given)
    except InstantiationException as error:
        if isinstance(error.__cause__, UserError):
            where = f"{node}." if node else ""
            raise UserError(f"{where}{error.__cause__}") from None
        raise
