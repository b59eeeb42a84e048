"""AVN: audio-visual embodied navigation on a bare CPU machine.

The names below are imported when they are first used, so that `import avn` is fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from avn.core.errors import UserError
    from avn.integrations.torchrl import make_env
    from avn.library import (
        evaluate,
        load_scene,
        load_views,
        make_simulator,
        render_clip,
        scene_names,
        train,
    )
    from avn.navigation import metrics
    from avn.navigation.simulator import Simulator
    from avn.reporting.results import summarise

from avn.core.caches import choose_cache_folders
from avn.integrations.registration import register_when_imported

__version__ = "0.1.0"
choose_cache_folders()
register_when_imported()

# Module of each public name, or the module that the name stands for.
_PUBLIC = {
    "Simulator": "avn.navigation.simulator",
    "UserError": "avn.core.errors",
    "evaluate": "avn.library",
    "load_scene": "avn.library",
    "load_views": "avn.library",
    "make_env": "avn.integrations.torchrl",
    "make_simulator": "avn.library",
    "metrics": "avn.navigation.metrics",
    "render_clip": "avn.library",
    "scene_names": "avn.library",
    "summarise": "avn.reporting.results",
    "train": "avn.library",
}
__all__ = [
    "Simulator",
    "UserError",
    "evaluate",
    "load_scene",
    "load_views",
    "make_env",
    "make_simulator",
    "metrics",
    "render_clip",
    "scene_names",
    "summarise",
    "train",
]


def __getattr__(name: str) -> Any:
    """Import a public name."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'avn' has no attribute '{name}'; it has {', '.join(__all__)}")
    module = import_module(_PUBLIC[name])
    return module if _PUBLIC[name].endswith(f".{name}") else getattr(module, name)


def __dir__() -> list[str]:
    """Return the public names and those that are imported already."""
    return sorted({*globals(), *__all__})
