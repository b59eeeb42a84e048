"""`film=4` of `avn.eval`: films of some episodes of a run, with the sound that the agent hears."""

from __future__ import annotations

from pathlib import Path

from omegaconf import DictConfig

from avn.core.errors import UserError
from avn.core.files import check_name, locked
from avn.core.progress import span, tell
from avn.core.settings import leaves
from avn.pipeline import replay
from avn.pipeline.observed import Perceived, observed_stages, soundtrack
from avn.pipeline.replay import Run
from avn.pipeline.run import read_run
from avn.reporting.film import write_film

FOLDER = "films"
MOST = 1000


def check(cfg: DictConfig) -> None:
    """Refuse `film` and `film_show` that cannot work, before anything is walked."""
    if not 0 <= cfg.film <= MOST:
        raise UserError(f"film: {cfg.film} is out of range; give how many, 0 to {MOST}")
    if cfg.film_show not in replay.SHOWS:
        raise UserError(f"film_show: '{cfg.film_show}' is none of {', '.join(replay.SHOWS)}")


def read(cfg: DictConfig) -> set[str]:
    """Leaf keys of the config that films read beyond what their run does."""
    if not cfg.film:
        return set()
    stages = observed_stages(cfg)
    for stage in stages:
        stage.check()
    return leaves(cfg, ["microphone"]).union(*(stage.read() for stage in stages))


def make_films(cfg: DictConfig, folder: Path) -> list[Path]:
    """Write up to `film` films of a finished run; those that are there stay as they are.

    Parameters
    ----------
    cfg : DictConfig
        Of `avn.eval`: `film` says how many, `film_show` which.
    folder : Path
        The run's.

    Returns
    -------
    list of Path
        The films.
    """
    if not cfg.film:
        return []
    run = Run(folder, cfg, *read_run(folder))
    labels = replay.choose(run.episodes, cfg.film_show, cfg.film)
    if not labels:
        tell(f"film_show: the run has no episode that is a {cfg.film_show}")
    paths = {label: folder / FOLDER / _name(run, label) for label in labels}
    missing = [label for label in labels if not paths[label].is_file()]
    if missing:
        what = "film" if len(missing) == 1 else f"{len(missing)} films"
        tell(f"{what} of '{cfg.agent.name}' missing: making (about {span(15.0 * len(missing))})")
        with locked(folder / FOLDER, what):
            _write(run, {label: paths[label] for label in missing})
    for path in paths.values():
        tell(str(path))
    return list(paths.values())


def _name(run: Run, label: int) -> str:
    row = run.episodes.loc[label]
    check_name("sound", str(row["sound"]))
    return f"{row['room']}-{row['sound']}-{row['episode']}-{row['outcome']}.mp4"


def _write(run: Run, paths: dict[int, Path]) -> None:
    perceived = Perceived(run)
    for trace, path in zip(replay.traces(run, list(paths)), paths.values(), strict=True):
        clips = perceived.clips(trace)
        views = perceived.views(trace.place.name, trace.state)
        write_film(path, trace, str(run.cfg.agent.name), views, clips, soundtrack(clips))
