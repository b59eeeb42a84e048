"""Finished runs, walked again from their own config, so that pictures show what happened in them.

Runs are deterministic: a run that cannot be walked again to the very same records was made by
other code, and is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
from omegaconf import DictConfig

from avn.agents.recorder import Recorder
from avn.agents.rollout import Watch
from avn.core.errors import UserError
from avn.core.settings import plain
from avn.dataset.scene import Scene
from avn.navigation.trace import Trace
from avn.pipeline.run import Evaluation, read_run, walk_rooms
from avn.pipeline.stage import MACHINE, build

# Settings that a run is named by where it differs in them from the others.
_TELLING = ("protocol", "acoustics", "look", "localisation", "exploration", "seed", "train_seed")
_OTHER = "the run is of another version of avn or of its networks: run avn.eval again"
SHOWS = ("typical", "success", "failure")


@dataclass
class Run:
    """A finished run.

    Attributes
    ----------
    folder : Path
    cfg : DictConfig
    results, episodes : DataFrame
        `results.csv` and `episodes.csv`.
    """

    folder: Path
    cfg: DictConfig
    results: pd.DataFrame
    episodes: pd.DataFrame
    _rooms: list[Scene] = field(default_factory=list)

    @property
    def settings(self) -> dict[str, str]:
        """The settings that the run reads, as dotted keys and texts."""
        read = sorted(Evaluation(self.cfg).read())
        return {key: str(plain(self.cfg, key)) for key in read}

    @property
    def rooms(self) -> list[Scene]:
        """The scenes that were walked."""
        if not self._rooms:
            geometry = Evaluation(self.cfg).geometry
            build(geometry)
            self._rooms = geometry.load()
        return self._rooms


def open_run(folder: Path, cfg: DictConfig) -> Run:
    """Read a finished run from its folder.

    Parameters
    ----------
    folder : Path
        `outputs/eval/<agent>/<sounds>/<run>`.
    cfg : DictConfig
        Its config; see `avn.config.saved.read_config`.

    Raises
    ------
    UserError
        Where its records are missing or damaged.
    """
    return Run(folder, cfg, *read_run(folder))


def choose(episodes: pd.DataFrame, show: str, count: int) -> list[int]:
    """Rows of `episodes.csv` that are worth showing.

    Parameters
    ----------
    episodes : DataFrame
        Records of one run, or some of them.
    show : {"typical", "success", "failure"}
        Those nearest to the median SPL; those that succeeded by their SPL nearest to the median
        of these; those that failed, by how far from the source they ended.
    count : int
        At most so many, as far apart in sounds and rooms as there are.

    Returns
    -------
    list of int
        Index labels of `episodes`, the fittest first.
    """
    if show not in SHOWS:
        raise UserError(f"--show: '{show}' is none of {', '.join(SHOWS)}")
    chosen = episodes
    if show != "typical":
        chosen = episodes[episodes["success"] == (show == "success")]
    if not len(chosen) or count < 1:
        return []
    figure = "dtg" if show == "failure" else "spl"
    off = (chosen[figure] - chosen[figure].median()).abs()
    # of equals the one whose source is as far away as usual, for it is neither easy nor odd
    far = (chosen["geodesic"] - episodes["geodesic"].median()).abs()
    ranked = chosen.assign(off=off, far=far).sort_values(["off", "far"], kind="stable")
    ranked["round"] = ranked.groupby(["scene", "sound"]).cumcount()
    ranked["room_round"] = ranked.groupby(["round", "scene"]).cumcount()
    ranked = ranked.sort_values(["round", "room_round", "off", "far"], kind="stable")
    return [int(label) for label in ranked.index[:count]]


def same_episodes(run: Run, labels: Sequence[int], other: Run) -> list[int]:
    """Rows of another run's `episodes.csv` with the same episodes.

    Raises
    ------
    UserError
        Where the other run did not walk them.
    """
    where = dict(zip(episode_keys(other.episodes), other.episodes.index, strict=True))
    wanted = episode_keys(run.episodes.loc[list(labels)])
    if not set(wanted) <= set(where):
        raise UserError(
            f"{other.folder}: walked other episodes than {run.folder}; give runs with the same "
            "split, protocol, sound and seed"
        )
    return [int(where[row]) for row in wanted]


def episode_keys(episodes: pd.DataFrame) -> list[tuple[Any, ...]]:
    """What tells which episode a record is of, whoever walked it."""
    keys = ["scene", "sound", "seed", "episode", "source_cell", "start_cell", "start_heading"]
    return [tuple(row) for row in episodes[keys].itertuples(index=False)]


def names_of(runs: Sequence[Run]) -> list[str]:
    """Names that tell runs apart: the agent, and those settings in which they differ."""
    settings = [run.settings for run in runs]
    keys = [key for own in settings for key in own]
    keys = [key for key in dict.fromkeys(keys) if len(_values(key, settings)) > 1]
    shown = {key: label for key in keys if (label := _label(key))}
    names = []
    for run, own in zip(runs, settings, strict=True):
        parts = dict.fromkeys(f"{shown[key]}={own[key]}" for key in shown if key in own)
        names.append(", ".join((str(run.cfg.agent.name), *parts)))
    if len(set(names)) < len(names):  # settings of networks or of rooms
        names = [f"{name} ({run.folder.name})" for name, run in zip(names, runs, strict=True)]
    return names


def settings_but_seed(run: Run) -> str:
    """All settings of a run that make its records, but for the seed of its episodes."""
    others = ("seed", *MACHINE, "film", "film_show")
    return repr([(key, value) for key, value in run.settings.items() if key not in others])


def _label(key: str) -> str:
    """What a setting is called in a name; empty where it is not told."""
    first, last = key.split(".")[0], key.rsplit(".", 1)[-1]
    if first in _TELLING:
        return key.removesuffix(".name")
    # a saved config holds what `look` and the like were resolved to
    return last if last in ("look", "localisation", "train_seed") else ""


def _values(key: str, settings: Sequence[Mapping[str, str]]) -> set[str]:
    """What runs that read a setting have for it."""
    return {own[key] for own in settings if key in own}


def traces(run: Run, labels: Sequence[int], beliefs: bool = True) -> list[Trace]:
    """Walk a run again, in the rooms of some episodes, and keep their traces.

    Parameters
    ----------
    run : Run
    labels : sequence of int
        Rows of `episodes.csv`.
    beliefs : bool
        Whether what an agent with a map took to be true is kept too.

    Raises
    ------
    UserError
        Where the walk is another than the one that the run recorded.
    """
    (found,) = walk_again(run, [(labels, beliefs)])
    return found


def walk_again(run: Run, wanted: Iterable[tuple[Sequence[int], bool]]) -> list[list[Trace]]:
    """As `traces`, of several choices in one walk."""
    explicit = list(wanted)
    names = set(run.episodes.loc[[label for labels, _ in explicit for label in labels], "scene"])
    kept = [index for index, room in enumerate(run.rooms) if room.name in names]
    # in a batch the episodes of a room stand in the order of its records
    rows = run.episodes.groupby("scene").cumcount()
    recorders = [
        Recorder(_by_room(run, rows, labels), run.cfg.realisations, beliefs)
        for labels, beliefs in explicit
    ]

    def watch(*step: Any) -> bool:
        enough = [recorder(*step) for recorder in recorders]  # each of them sees every step
        return all(enough)

    # a run of another version must not set off the training of this version's networks
    cfg = run.cfg.copy()
    own = run.folder.resolve().name.endswith(Evaluation(cfg).fingerprint[:8])
    cfg.auto = cfg.auto and own
    try:
        walked = _walk(cfg, run.rooms, kept, watch)
    except UserError as error:
        if own:
            raise
        raise UserError(f"{run.folder}: {_OTHER} ({error})") from error
    _check_same(
        run, pd.concat(walked, ignore_index=True), [own for part, _ in explicit for own in part]
    )
    return [
        [
            recorder.trace(str(row["scene"]), int(rows[label]), row)
            for label, row in zip(labels, _records(run, labels), strict=True)
        ]
        for recorder, (labels, _) in zip(recorders, explicit, strict=True)
    ]


def _walk(
    cfg: DictConfig, rooms: Sequence[Scene], kept: Sequence[int], watch: Watch
) -> list[pd.DataFrame]:
    """Walk some of the rooms of a config, by number."""
    evaluation = Evaluation(cfg)
    for need in evaluation.needs():
        build(need)
    observations = evaluation.observed.load(rooms)
    return walk_rooms(
        cfg,
        [rooms[i] for i in kept],
        [observations[i] for i in kept],
        watch,
    )


def _by_room(run: Run, rows: pd.Series, labels: Sequence[int]) -> dict[str, list[int]]:
    own = run.episodes.loc[list(labels), "scene"]
    return {str(room): rows.loc[part.index].tolist() for room, part in own.groupby(own)}


def _records(run: Run, labels: Sequence[int]) -> list[Mapping[str, Any]]:
    found = run.episodes.loc[list(labels)].to_dict("records")
    return [{**row, "row": int(label)} for label, row in zip(labels, found, strict=True)]  # type: ignore[dict-item]


def _check_same(run: Run, walked: pd.DataFrame, labels: Sequence[int]) -> None:
    """Raise `UserError` unless the episodes of `labels` went as the run's records say."""
    keys = ["scene", "sound", "episode"]
    own = run.episodes.loc[sorted(set(labels))]
    again = own[keys].merge(walked, on=keys, how="left")[list(own.columns)]
    try:
        pd.testing.assert_frame_equal(
            again, own.reset_index(drop=True), check_dtype=False, rtol=1e-9
        )
    except AssertionError as error:
        raise UserError(
            f"{run.folder}: walked again, its episodes end otherwise than episodes.csv says: "
            + _OTHER
        ) from error
