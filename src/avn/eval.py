"""`python -m avn.eval agent=greedy sound=alarm`: evaluates an agent and prints its row."""

from __future__ import annotations

import sys
from pathlib import Path

from omegaconf import DictConfig

from avn.config.cli import command
from avn.config.unread import refuse_unread
from avn.core.progress import log


@command("eval")
def main(cfg: DictConfig) -> Path:
    """Evaluate an agent, or read its finished run, and print the table."""
    from avn.pipeline import films
    from avn.pipeline.run import Evaluation, show_run
    from avn.pipeline.stage import build

    films.check(cfg)
    run = Evaluation(cfg)
    run.check()
    refuse_unread("eval", cfg, run.read() | films.read(cfg))
    build(run, explicit=True)
    folder = run.folder
    show_run(cfg, folder)
    films.make_films(cfg, folder)
    log(str(folder))
    return folder


if __name__ == "__main__":
    sys.exit(main())
