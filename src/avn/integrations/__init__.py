"""Interfaces to other libraries: environments for TorchRL (`make_env`) and Gymnasium."""

from typing import Any

__all__ = ["make_env"]


def __getattr__(name: str) -> Any:
    """Import `make_env` when it is first used, as it imports torch."""
    if name == "make_env":
        from avn.integrations.torchrl import make_env

        return make_env
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
