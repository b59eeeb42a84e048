"""Figures of finished runs: trajectories, estimates, beliefs, memory, results by difficulty."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure
from torch.utils.tensorboard import SummaryWriter

from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.core.progress import log
from avn.navigation.trace import Trace
from avn.pipeline import replay
from avn.pipeline.replay import Run
from avn.reporting.belief_figures import belief_figure, memory_figure
from avn.reporting.breakdown import breakdown_figure
from avn.reporting.trajectory_figures import estimate_figure, trajectory_figure

FOLDER = "figures"
_SUFFIX = ".figures"


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
    names = replay.names_of(runs)
    made = {
        "breakdown": breakdown_figure(dict(zip(names, (r.episodes for r in runs), strict=True)))
    }
    if labels:
        traces = [replay.traces(run, replay.same_episodes(first, labels, run)) for run in runs]
        made |= episode_figures(traces, names)
    else:
        log(f"{first.folder}: no episode to show (--show {show})")
    write_figures(first.folder, made)


def episode_figures(traces: Sequence[Sequence[Trace]], names: Sequence[str]) -> dict[str, Figure]:
    """Draw the figures of episodes of several runs.

    Parameters
    ----------
    traces : sequence of sequences of Trace
        Traces of the same episodes, by run.
    names : sequence of str
        Names of the runs.

    Returns
    -------
    dict of str to Figure
        Figures by name; those of one episode are of the first run.
    """
    made = {"trajectories": trajectory_figure(list(zip(*traces, strict=True)), names)}
    kinds: tuple[tuple[str, Callable[[Trace, str], Figure]], ...] = (
        ("estimates", estimate_figure),
        ("belief", belief_figure),
        ("memory", memory_figure),
    )
    for trace in traces[0]:
        record = trace.record
        for kind, draw in kinds:
            try:
                figure = draw(trace, names[0])
            except ValueError:
                continue  # an agent without this part
            made[f"{kind}-{record['scene']}-{record['sound']}-{record['episode']}"] = figure
    return made


def write_figures(folder: Path, made: dict[str, Figure]) -> None:
    """Write figures to a run's folder and TensorBoard; older ones are replaced."""
    for old in folder.glob(f"events.*{_SUFFIX}"):
        old.unlink()
    with SummaryWriter(str(folder), filename_suffix=_SUFFIX) as writer:
        for name, figure in made.items():
            path = folder / FOLDER / f"{name}.png"
            with atomic_write(path) as part:
                figure.savefig(part, format="png", metadata={"Software": None})
            log(str(path))
            writer.add_figure(f"figures/{name.replace('-', '/', 1)}", figure)
