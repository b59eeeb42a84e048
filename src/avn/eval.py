"""`python -m avn.eval agent=greedy sound=alarm`: evaluates an agent and prints its row."""

from __future__ import annotations

import sys
from pathlib import Path

from omegaconf import DictConfig

from avn.config import answers
from avn.config.cli import command
from avn.config.unread import refuse_unread
from avn.core.progress import log

# File that marks a run as finished.
_FINISHED = "results.csv"


@command("eval")
def main(cfg: DictConfig) -> Path:
    """Evaluate an agent, or read its finished run, and print the table."""
    simple = not (cfg.film or cfg.force)
    folder = answers.recall("eval", cfg, _FINISHED) if simple else None
    if folder is None:
        folder = _evaluate(cfg)
        if simple:
            answers.remember("eval", cfg, folder)
    else:
        _show(cfg, folder)
    log(str(folder))
    return folder


def _evaluate(cfg: DictConfig) -> Path:
    from avn.pipeline import films
    from avn.pipeline.run import Evaluation
    from avn.pipeline.stage import build

    films.check(cfg)
    run = Evaluation(cfg)
    run.check()
    refuse_unread("eval", cfg, run.read() | films.read(cfg))
    build(run, explicit=True)
    _show(cfg, run.folder)
    films.make_films(cfg, run.folder)
    return run.folder


def _show(cfg: DictConfig, folder: Path) -> None:
    from avn.reporting.finished_run import show_run

    show_run(folder, cfg.agent.privileged)


if __name__ == "__main__":
    sys.exit(main())
