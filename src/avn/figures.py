"""`python -m avn.figures RUN [RUN...]`: pictures of what happened in finished runs.

PNG files in the first run's folder `figures/`, and the same in its TensorBoard.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from avn.config.cli import plainly


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw what the command line asks for; gives the exit code."""
    return plainly("avn.figures", lambda: _draw(_parse(arguments)))


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m avn.figures", description=__doc__)
    parser.add_argument(
        "runs", nargs="+", type=Path, metavar="RUN", help="folders of runs; others stand beside"
    )
    parser.add_argument("--show", default="typical", help="which: typical, success or failure")
    parser.add_argument("--count", default=4, type=int, help="how many episodes to choose")
    parser.add_argument(
        "--episode", type=int, action="append", metavar="ROW", help="a row of episodes.csv, from 0"
    )
    return parser.parse_args(arguments)


def _draw(options: argparse.Namespace) -> None:
    from avn.config.saved import read_config
    from avn.pipeline import replay
    from avn.pipeline.run_figures import draw_runs

    runs = [replay.open_run(folder, read_config(folder)) for folder in options.runs]
    draw_runs(runs, options.show, options.count, options.episode)


if __name__ == "__main__":
    sys.exit(main())
