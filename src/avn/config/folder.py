"""Where the config files lie."""

from __future__ import annotations

from pathlib import Path


def conf_folder() -> Path:
    """The folder of configs: beside the package in a wheel, at the top of a checkout."""
    packaged = Path(__file__).parents[1] / "conf"
    return packaged if packaged.is_dir() else Path(__file__).parents[3] / "conf"
