"""Figures of finished runs: trajectories, estimates, beliefs, memory, results by difficulty."""

from __future__ import annotations

import glob
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure
from torch.utils.tensorboard import SummaryWriter

from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.core.hashing import digest
from avn.core.progress import log
from avn.navigation.trace import Trace
from avn.pipeline import replay
from avn.pipeline.benchmark import caption_of
from avn.pipeline.replay import Run
from avn.pipeline.run_names import names_of
from avn.reporting.belief_figures import belief_figure, memory_figure
from avn.reporting.breakdown import breakdown_figure
from avn.reporting.trajectory_figures import estimate_figure, trajectory_figure

FOLDER = "figures"
_SUFFIX = ".figures"
# Letters of the name of a selection.
_LONGEST = 40


def draw_runs(runs: Sequence[Run], show: str, count: int, episodes: Sequence[int] | None) -> None:
    """Write the figures of some runs to the folder and the TensorBoard of the first run.

    Parameters
    ----------
    runs : sequence of Run
        Runs over the same episodes.
    show : {"typical", "success", "failure"}
        Selection of episodes; see `avn.pipeline.replay.choose`.
    count : int
        Number of episodes.
    episodes : sequence of int, optional
        Rows of the first run's `episodes.csv` to draw instead of the selection.

    Raises
    ------
    UserError
        Where a run lacks an episode.
    """
    first = runs[0]
    labels = list(episodes or replay.choose(first.episodes, show, count))
    if unknown := set(labels) - set(first.episodes.index):
        raise UserError(f"--episode: {first.folder} has no row {min(unknown)} in episodes.csv")
    names = names_of(runs)
    caption = caption_of(first.cfg, first.default)
    records = dict(zip(names, (run.episodes for run in runs), strict=True))
    made = {"breakdown": breakdown_figure(records, caption=caption)}
    if labels:
        traces = [replay.traces(run, replay.same_episodes(first, labels, run)) for run in runs]
        made |= episode_figures(traces, names, caption)
    else:
        log(f"{first.folder}: no episode to show (--show {show})")
    chosen = f"rows-{'-'.join(map(str, episodes))}" if episodes else f"{show}-{count}"
    write_figures(first.folder, _selection(chosen, runs), made)


def _selection(chosen: str, runs: Sequence[Run]) -> str:
    """Name the choice of episodes and the other runs, so that each call has its own folder."""
    name = chosen if len(chosen) <= _LONGEST else f"{chosen[:_LONGEST]}-{digest(chosen)[:8]}"
    others = [f"{run.cfg.agent.name}-{run.folder.name}" for run in runs[1:]]
    if len(others) > 1:
        others = [f"{len(others)}-runs-{digest(others)[:8]}"]
    return "-with-".join((name, *others))


def episode_figures(
    traces: Sequence[Sequence[Trace]], names: Sequence[str], caption: str = ""
) -> dict[str, Figure]:
    """Draw the figures of episodes of several runs.

    Parameters
    ----------
    traces : sequence of sequences of Trace
        Traces of the same episodes, by run.
    names : sequence of str
        Names of the runs.
    caption : str
        World of the runs, below each figure.

    Returns
    -------
    dict of str to Figure
        Figures by name; those of one episode are of the first run.
    """
    made = {"trajectories": trajectory_figure(list(zip(*traces, strict=True)), names, caption)}
    kinds: tuple[tuple[str, Callable[[Trace, str, str], Figure]], ...] = (
        ("estimates", estimate_figure),
        ("belief", belief_figure),
        ("memory", memory_figure),
    )
    for trace in traces[0]:
        record = trace.record
        for kind, draw in kinds:
            try:
                figure = draw(trace, names[0], caption)
            except ValueError:
                continue  # an agent without this part
            made[f"{kind}-{record['scene']}-{record['sound']}-{record['episode']}"] = figure
    return made


def write_figures(folder: Path, selection: str, made: dict[str, Figure]) -> None:
    """Write figures to a run's folder and TensorBoard; those of the same selection are replaced.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    selection : str
        Name of the folder below `figures`.
    made : dict of str to Figure
        Figures by name.
    """
    suffix = f".{selection}{_SUFFIX}"
    for old in folder.glob(f"events.*{glob.escape(suffix)}"):
        old.unlink()
    with SummaryWriter(str(folder), filename_suffix=suffix) as writer:
        for name, figure in made.items():
            path = folder / FOLDER / selection / f"{name}.png"
            with atomic_write(path) as part:
                figure.savefig(part, format="png", metadata={"Software": None})
            log(str(path))
            writer.add_figure(f"figures/{selection}/{name.replace('-', '/', 1)}", figure)
