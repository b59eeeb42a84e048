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
    # of the files that the defaults of a policy name, a record cannot know
    simple = not (cfg.film or cfg.force or cfg.policy)
    answer = answers.recall("eval", cfg, _FINISHED) if simple else None
    if answer is None:
        folder = _evaluate(cfg)
    else:
        from avn.reporting.finished_run import show_run

        folder = answer.folder
        show_run(folder, **answer.shown)
    log(str(folder))
    return folder


def _evaluate(cfg: DictConfig) -> Path:
    from avn.config.defaults import default_config
    from avn.pipeline import films
    from avn.pipeline.benchmark import headings
    from avn.pipeline.building import build
    from avn.pipeline.run import Evaluation
    from avn.reporting.finished_run import show_run

    films.check(cfg)
    run = Evaluation(cfg)
    run.check()
    refuse_unread("eval", cfg, run.read() | films.read(cfg))
    build(run, explicit=True)
    default = default_config(cfg)
    shown = headings(cfg, default)
    show_run(run.folder, **shown)
    films.make_films(cfg, run.folder, default)
    if not (cfg.film or cfg.policy):
        answers.remember("eval", cfg, run.folder, shown)
    return run.folder


if __name__ == "__main__":
    sys.exit(main())
