"""`python -m avn.figures RUN [RUN...]`: draws figures of episodes of finished runs.

Writes PNG files to the first run's `figures/<selection>/`, and the figures to its TensorBoard.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from avn.config.cli import plainly
from avn.core.numerics import use_of_runs


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the figures and return the exit code."""
    return plainly("avn.figures", lambda: _draw(_parse(arguments)))


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m avn.figures", description=__doc__)
    parser.add_argument(
        "runs", nargs="+", type=Path, metavar="RUN", help="folders of runs, to compare side by side"
    )
    parser.add_argument("--show", default="typical", help="which: typical, success or failure")
    parser.add_argument("--count", default=4, type=int, help="how many episodes to choose")
    parser.add_argument(
        "--episode", type=int, action="append", metavar="ROW", help="a row of episodes.csv, from 0"
    )
    return parser.parse_args(arguments)


def _draw(options: argparse.Namespace) -> None:
    from avn.config.defaults import default_config
    from avn.config.saved import read_config
    from avn.pipeline import replay
    from avn.pipeline.run_figures import draw_runs

    configs = [(folder, read_config(folder)) for folder in options.runs]
    use_of_runs([cfg.numerics for _, cfg in configs])
    runs = [replay.open_run(folder, cfg, default_config(cfg)) for folder, cfg in configs]
    draw_runs(runs, options.show, options.count, options.episode)


if __name__ == "__main__":
    sys.exit(main())
