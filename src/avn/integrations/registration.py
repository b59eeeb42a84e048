"""Registration of "avn/Walk-v0" with Gymnasium, as soon as a program imports Gymnasium.

Importing Gymnasium takes longer than most commands need to answer, so `import avn` does not.
"""

from __future__ import annotations

import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import Any

WALK = "avn/Walk-v0"


def register() -> None:
    """Register the environment with Gymnasium; further calls change nothing."""
    import gymnasium

    if WALK not in gymnasium.registry:
        gymnasium.register(
            id=WALK,
            entry_point="avn.integrations.gymnasium:make_env",
            vector_entry_point="avn.integrations.gymnasium:make_vector_env",
        )


def register_when_imported() -> None:
    """Register the environment now, or after the first import of Gymnasium."""
    if "gymnasium" in sys.modules:
        register()
    elif not any(isinstance(finder, _Gymnasium) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Gymnasium())


class _Gymnasium(MetaPathFinder):
    """Finder that leaves Gymnasium to the others and registers the environment afterwards."""

    def __init__(self) -> None:
        self._asks_others = False

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Find the module `gymnasium`.

        Parameters
        ----------
        name : str
            Full name of a module.
        path, target
            See `MetaPathFinder`; not used.
        """
        if name != "gymnasium" or self._asks_others:
            return None
        self._asks_others = True
        try:
            spec = find_spec(name)
        finally:
            self._asks_others = False
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute(module)
                # not before: a program may look for the module and not import it
                sys.meta_path.remove(self)
                register()

            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec
