"""Films of a run's episodes with the sound that the agent hears (`film` of `avn.eval`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from omegaconf import DictConfig

from avn.core.errors import UserError
from avn.core.files import atomic_write, check_name, locked
from avn.core.hashing import digest
from avn.core.progress import format_duration, log
from avn.core.settings import leaves, plain
from avn.pipeline import replay
from avn.pipeline.benchmark import note_of
from avn.reporting.finished_run import read_run

if TYPE_CHECKING:
    from avn.pipeline.replay import Run

FOLDER = "films"
# Holds the fingerprint of the films of a folder.
_MARK = ".made_from"
MOST = 1000
# Least and most steps per second.
SPEEDS = (0.5, 10.0)


def check(cfg: DictConfig) -> None:
    """Refuse values of the settings of films that cannot work, before the run starts."""
    if not 0 <= cfg.film <= MOST:
        raise UserError(f"film: {cfg.film} is out of range; give how many, 0 to {MOST}")
    if not SPEEDS[0] <= cfg.film_speed <= SPEEDS[1]:
        raise UserError(
            f"film_speed: {cfg.film_speed:g} is out of range; give steps per second, "
            f"{SPEEDS[0]:g} to {SPEEDS[1]:g}"
        )
    if cfg.film_show not in replay.SHOWS:
        raise UserError(f"film_show: '{cfg.film_show}' is none of {', '.join(replay.SHOWS)}")


def read(cfg: DictConfig) -> set[str]:
    """Return the leaf keys of the config that films read in addition to their run."""
    from avn.pipeline.observed import observed_stages

    if not cfg.film:
        return set()
    stages = observed_stages(cfg)
    for stage in stages:
        stage.check()
    return leaves(cfg, ["microphone"]).union(*(stage.read() for stage in stages))


def make_films(cfg: DictConfig, folder: Path, default: DictConfig) -> list[Path]:
    """Write up to `film` films of a finished run.

    Existing films are kept unless views or microphone have changed.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.eval`: `film` is the number of films, `film_show` selects episodes, and
        `film_speed` is the number of steps per second.
    folder : Path
        Folder of the run.
    default : DictConfig
        Config of its row and options; see `avn.config.defaults.default_config`.

    Returns
    -------
    list of Path
        Files of the films.
    """
    from avn.pipeline.replay import Run

    if not cfg.film:
        return []
    run = Run(folder, cfg, *read_run(folder), default)
    labels = replay.choose(run.episodes, cfg.film_show, cfg.film)
    if not labels:
        log(f"film_show: the run has no episode that is a {cfg.film_show}")
    paths = {label: folder / FOLDER / _name(run, label) for label in labels}
    if labels:
        with locked(folder / FOLDER, "films"):
            _make_missing(run, paths)
    for path in paths.values():
        log(str(path))
    return list(paths.values())


def _make_missing(run: Run, paths: dict[int, Path]) -> None:
    """Write the missing films; delete films of other views or another microphone first."""
    mark, fingerprint = run.folder / FOLDER / _MARK, _fingerprint(run.cfg)
    if not (mark.is_file() and mark.read_text() == fingerprint):
        for old in (run.folder / FOLDER).glob("*.mp4"):
            old.unlink()
        with atomic_write(mark) as part:
            part.write_text(fingerprint)
    missing = {label: path for label, path in paths.items() if not path.is_file()}
    if missing:
        what = "film" if len(missing) == 1 else f"{len(missing)} films"
        name = run.cfg.agent.name
        log(f"{what} of '{name}' missing: making (about {format_duration(15.0 * len(missing))})")
        _write(run, missing)


def _fingerprint(cfg: DictConfig) -> str:
    """Return the fingerprint of the films' inputs besides the run itself."""
    from avn.pipeline.observed import observed_stages

    stages = [stage.fingerprint for stage in observed_stages(cfg)]
    return digest(stages, plain(cfg, "microphone"))


def _name(run: Run, label: int) -> str:
    row = run.episodes.loc[label]
    check_name("sound", str(row["sound"]))
    speed = "" if run.cfg.film_speed == 1 else f"-speed{run.cfg.film_speed:g}"
    return f"{row['scene']}-{row['sound']}-{row['episode']}-{row['outcome']}{speed}.mp4"


def _write(run: Run, paths: dict[int, Path]) -> None:

    from avn.pipeline.observed import RunObservations, soundtrack
    from avn.reporting.film import write_film

    observations = RunObservations(run)
    for trace, path in zip(replay.traces(run, list(paths)), paths.values(), strict=True):
        clips = observations.clips(trace)
        views = observations.views(trace.scene.name, trace.state)
        write_film(
            *(path, trace, str(run.cfg.agent.name), views, clips, soundtrack(clips)),
            speed=run.cfg.film_speed,
            note=note_of(run.cfg),
        )
