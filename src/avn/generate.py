"""`python -m avn.generate`: builds the apartments of a split, their acoustics and their views."""

from __future__ import annotations

import sys
from pathlib import Path

from omegaconf import DictConfig

from avn.config.cli import command
from avn.config.unread import refuse_unread
from avn.core.progress import log


@command("generate")
def main(cfg: DictConfig) -> Path:
    """Build all scenes of the split and write the exports."""
    from avn.pipeline.export import generate, settings_of

    refuse_unread("generate", cfg, settings_of(cfg))
    folder = generate(cfg)
    log(str(folder))
    return folder


if __name__ == "__main__":
    sys.exit(main())
