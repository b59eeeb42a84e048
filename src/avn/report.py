"""`python -m avn.report RUN [RUN...]`: one HTML file with results, episodes, views and sound.

The file is self-contained and works offline.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from avn.config.cli import plainly
from avn.core.numerics import use_of_runs
from avn.core.progress import log


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page and return the exit code."""
    return plainly("avn.report", lambda: _report(_parse(arguments)))


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m avn.report", description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folders of runs")
    parser.add_argument(
        "--episodes",
        type=int,
        default=1,
        metavar="N",
        help="episodes of each scene and sound with views and sound, 0 for none (1)",
    )
    parser.add_argument(
        "--show",
        default="typical",
        help="which: typical, success, failure, or several of them with commas",
    )
    parser.add_argument(
        "--paths",
        action="store_true",
        help="paths of all other episodes too; replays each run, which takes some minutes",
    )
    parser.add_argument("--output", type=Path, help="the file (outputs/report/report-<hash8>.html)")
    return parser.parse_args(arguments)


def _report(options: argparse.Namespace) -> None:
    from avn.config.defaults import default_config
    from avn.config.saved import read_config
    from avn.pipeline import replay
    from avn.pipeline.report_page import write_page

    configs = [(folder, read_config(folder)) for folder in options.runs]
    use_of_runs([cfg.numerics for _, cfg in configs])
    runs = [replay.open_run(folder, cfg, default_config(cfg)) for folder, cfg in configs]
    log(str(write_page(runs, options.episodes, options.show, options.paths, options.output)))


if __name__ == "__main__":
    sys.exit(main())
