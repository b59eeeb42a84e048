"""`python -m avn.generate`: builds the apartments of a split, their sound and their views."""

from __future__ import annotations

import sys
from pathlib import Path

from omegaconf import DictConfig

from avn.config.cli import command
from avn.core.progress import tell
from avn.pipeline.export import generate


@command("generate")
def main(cfg: DictConfig) -> Path:
    """Make all scenes of the split and export what is asked for."""
    folder = generate(cfg)
    tell(str(folder))
    return folder


if __name__ == "__main__":
    sys.exit(main())
