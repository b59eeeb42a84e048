"""Classes by the name that a config gives them."""

from __future__ import annotations

import importlib
from typing import Any

from avn.core.errors import UserError


def import_class(option: str, target: str) -> Any:
    """The class that a config names.

    Parameters
    ----------
    option : str
        The key of the config, for the message.
    target : str
        Module and class, such as `avn.views.raycast.Raycast`.

    Raises
    ------
    UserError
        Where it cannot be imported.
    """
    module, _, name = target.rpartition(".")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise UserError(
            f"{option}: '{target}' cannot be had ({error}); is its folder on PYTHONPATH?"
        ) from error
