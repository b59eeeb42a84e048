"""`python -m avn.eval agent=greedy sound=alarm`: lets an agent walk and prints its row."""

from __future__ import annotations

import sys
from pathlib import Path

from omegaconf import DictConfig

from avn import evaluation, films
from avn.cli import command
from avn.stages import tell


@command("eval")
def main(cfg: DictConfig) -> Path:
    """Evaluate one row, or open its finished run, and print the table."""
    films.check(cfg)
    folder = evaluation.evaluate(cfg)
    evaluation.show(cfg, folder)
    films.make_films(cfg, folder)
    tell(str(folder))
    return folder


if __name__ == "__main__":
    sys.exit(main())
