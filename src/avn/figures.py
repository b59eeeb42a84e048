"""`python -m avn.figures RUN [RUN...]`: pictures of what happened in finished runs.

PNG files in the first run's folder `figures/`, and the same in its TensorBoard.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure
from torch.utils.tensorboard import SummaryWriter

from avn import replay
from avn.cli import plainly
from avn.errors import UserError
from avn.navigation.trace import Trace
from avn.reporting.breakdown import breakdown_figure
from avn.reporting.thought_figures import belief_figure, memory_figure
from avn.reporting.trajectory_figures import estimate_figure, trajectory_figure
from avn.stages import tell, written_whole

FOLDER = "figures"
_SUFFIX = ".figures"


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw what the command line asks for; gives the exit code."""
    return plainly("avn.figures", lambda: _draw(_parse(arguments)))


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m avn.figures", description=__doc__)
    parser.add_argument(
        "runs", nargs="+", type=Path, metavar="RUN", help="folders of runs; others stand beside"
    )
    parser.add_argument("--show", default="typical", help=", ".join(replay.SHOWS))
    parser.add_argument("--count", default=4, type=int, help="how many episodes to choose")
    parser.add_argument(
        "--episode", type=int, action="append", metavar="ROW", help="a row of episodes.csv, from 0"
    )
    return parser.parse_args(arguments)


def _draw(options: argparse.Namespace) -> None:
    runs = [replay.open_run(folder) for folder in options.runs]
    labels = options.episode or replay.choose(runs[0].episodes, options.show, options.count)
    first = runs[0]
    if unknown := set(labels) - set(first.episodes.index):
        raise UserError(f"--episode: {first.folder} has no row {min(unknown)} in episodes.csv")
    names = replay.names_of(runs)
    made = {
        "breakdown": breakdown_figure(dict(zip(names, (r.episodes for r in runs), strict=True)))
    }
    if labels:
        walked = [replay.traces(run, replay.same_episodes(first, labels, run)) for run in runs]
        made |= episode_figures(walked, names)
    else:
        tell(f"{first.folder}: no episode to show (--show {options.show})")
    write_figures(first.folder, made)


def episode_figures(walked: Sequence[Sequence[Trace]], names: Sequence[str]) -> dict[str, Figure]:
    """Pictures of episodes by name, of several runs over the same episodes.

    Parameters
    ----------
    walked : sequence of sequences of Trace
        By run and episode.
    names : sequence of str
        Of the runs.
    """
    made = {"trajectories": trajectory_figure(list(zip(*walked, strict=True)), names)}
    kinds: tuple[tuple[str, Callable[[Trace, str], Figure]], ...] = (
        ("estimates", estimate_figure),
        ("belief", belief_figure),
        ("memory", memory_figure),
    )
    for trace in walked[0]:
        record = trace.record
        for kind, draw in kinds:
            try:
                figure = draw(trace, names[0])
            except ValueError:
                continue  # an agent without this part
            made[f"{kind}-{record['room']}-{record['sound']}-{record['episode']}"] = figure
    return made


def write_figures(folder: Path, made: dict[str, Figure]) -> None:
    """Write pictures into a run's folder and its TensorBoard, in the place of older ones."""
    for old in folder.glob(f"events.*{_SUFFIX}"):
        old.unlink()
    with SummaryWriter(str(folder), filename_suffix=_SUFFIX) as writer:
        for name, figure in made.items():
            path = folder / FOLDER / f"{name}.png"
            with written_whole(path) as part:
                figure.savefig(part, format="png", metadata={"Software": None})
            tell(str(path))
            writer.add_figure(f"figures/{name.replace('-', '/', 1)}", figure)


if __name__ == "__main__":
    sys.exit(main())
