"""Replay of finished runs from their config, to obtain the traces of episodes.

Runs are deterministic: a run whose replay gives other records was made by other code, and is
refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd
from omegaconf import DictConfig

from avn.acoustics.sound_names import BUILTIN
from avn.agents.recorder import Recorder
from avn.agents.rollout import Watch
from avn.core.errors import UserError
from avn.core.settings import leaves, plain
from avn.dataset.scene import Scene
from avn.navigation.trace import Trace
from avn.pipeline.building import build
from avn.pipeline.recordings import has_recordings, with_recordings
from avn.pipeline.run import Evaluation, rollout_scenes
from avn.pipeline.sounds import sound_files, sounds_content
from avn.reporting.finished_run import read_run

_OTHER = (
    "it was made with other code, networks or classes of your own; run avn.eval again and give the "
    "folder that it prints"
)
_START = ("source", "start_cell", "start_heading")
SHOWS = ("typical", "success", "failure")


@dataclass
class Run:
    """Finished run.

    Attributes
    ----------
    folder : Path
        Folder of the run.
    cfg : DictConfig
        Config of the run.
    results, episodes : DataFrame
        `results.csv` and `episodes.csv`.
    default : DictConfig
        Config of its row and options without changes; see `avn.config.defaults.default_config`.
    """

    folder: Path
    cfg: DictConfig
    results: pd.DataFrame
    episodes: pd.DataFrame
    default: DictConfig
    _scenes: list[Scene] = field(default_factory=list)

    @cached_property
    def settings(self) -> dict[str, str]:
        """Settings that the run reads, as dotted keys and texts; sounds as hashes of recordings."""
        read = sorted(Evaluation(self.cfg).read() - leaves(self.cfg, ["sound"]))
        hashes = {f"sound.{name}": known for name, known in sounds_content(self.cfg)}
        return {key: str(plain(self.cfg, key)) for key in read} | hashes

    @property
    def scenes(self) -> list[Scene]:
        """Scenes of the run."""
        if not self._scenes:
            geometry = Evaluation(self.cfg).geometry
            build(geometry)
            self._scenes = geometry.load()
        return self._scenes


def open_run(folder: Path, cfg: DictConfig, default: DictConfig) -> Run:
    """Read a finished run from its folder.

    Parameters
    ----------
    folder : Path
        `outputs/eval/<agent>/<sounds>/<run>`.
    cfg : DictConfig
        Its config; see `avn.config.saved.read_config`.
    default : DictConfig
        Config of its row and options; see `avn.config.defaults.default_config`.

    Raises
    ------
    UserError
        Where its records are missing or damaged, or a recording is no longer the one of the run.
    """
    records = read_run(folder)
    if has_recordings(folder):
        cfg = with_recordings(cfg, folder)
    elif not set(sound_files(cfg).values()) <= {*BUILTIN} and not _is_of(folder, cfg):
        raise UserError(f"{folder}: its recordings have changed, or {_OTHER}")
    return Run(folder, cfg, *records, default)


def _is_of(folder: Path, cfg: DictConfig) -> bool:
    """Return whether a run's folder is that of a config in this version, recordings included."""
    return folder.resolve().name.endswith(Evaluation(cfg).fingerprint[:8])


def choose(episodes: pd.DataFrame, show: str, count: int) -> list[int]:
    """Select representative episodes.

    Parameters
    ----------
    episodes : DataFrame
        Records of one run, or some of them.
    show : {"typical", "success", "failure"}
        All episodes, successes or failures, ranked by their distance to the median of the group:
        of the SPL, for failures of the final distance to the goal.
    count : int
        Maximum number of episodes; they are spread over scenes and sounds, and over starts.

    Returns
    -------
    list of int
        Index labels of `episodes`, the best ranked first.
    """
    if show not in SHOWS:
        raise UserError(f"--show: '{show}' is none of {', '.join(SHOWS)}")
    group = episodes
    if show != "typical":
        group = episodes[episodes["success"] == (show == "success")]
    if not len(group) or count < 1:
        return []
    metric = "dtg" if show == "failure" else "spl"
    off = (group[metric] - group[metric].median()).abs()
    # ties: the episode with a typical distance to the source
    far = (group["geodesic"] - episodes["geodesic"].median()).abs()
    ranked = group.assign(off=off, far=far).sort_values(["off", "far"], kind="stable")
    ranked["round"] = ranked.groupby(["scene", "sound"]).cumcount()
    ranked["scene_round"] = ranked.groupby(["round", "scene"]).cumcount()
    ranked = ranked.sort_values(["round", "scene_round", "off", "far"], kind="stable")
    # the same start with another sound comes after all other starts
    ranked["again"] = ranked.groupby(["scene", *_START]).cumcount()
    ranked = ranked.sort_values("again", kind="stable")
    return [int(label) for label in ranked.index[:count]]


def same_episodes(run: Run, labels: Sequence[int], other: Run) -> list[int]:
    """Return the rows of another run's `episodes.csv` with the same episodes.

    Parameters
    ----------
    run : Run
        Run of the given rows.
    labels : sequence of int
        Rows of its `episodes.csv`.
    other : Run
        Run to search.

    Raises
    ------
    UserError
        Where the other run lacks one of the episodes.
    """
    label_of = dict(zip(episode_keys(other.episodes), other.episodes.index, strict=True))
    wanted = episode_keys(run.episodes.loc[list(labels)])
    if not set(wanted) <= set(label_of):
        raise UserError(
            f"{other.folder}: has other episodes than {run.folder}; give runs with the same "
            "split, protocol, sound and seed"
        )
    return [int(label_of[key]) for key in wanted]


def episode_keys(episodes: pd.DataFrame) -> list[tuple[Any, ...]]:
    """Return the identity of each record's episode, independent of the agent."""
    keys = ["scene", "sound", "seed", "episode", "source_cell", "start_cell", "start_heading"]
    return [tuple(row) for row in episodes[keys].itertuples(index=False)]


def traces(run: Run, labels: Sequence[int], beliefs: bool = True) -> list[Trace]:
    """Replay a run in the scenes of some episodes and return their traces.

    Parameters
    ----------
    run : Run
        Finished run.
    labels : sequence of int
        Rows of `episodes.csv`.
    beliefs : bool
        Whether traces include the beliefs of an agent with a map.

    Raises
    ------
    UserError
        Where the replay differs from the records.
    """
    (selection,) = rollout_again(run, [(labels, beliefs)])
    return selection


def rollout_again(run: Run, wanted: Iterable[tuple[Sequence[int], bool]]) -> list[list[Trace]]:
    """Replay a run once for several selections of episodes; see `traces`."""
    selections = list(wanted)
    names = set(run.episodes.loc[[label for labels, _ in selections for label in labels], "scene"])
    kept = [index for index, scene in enumerate(run.scenes) if scene.name in names]
    # the batch of a scene has the episodes in the order of its records
    rows = run.episodes.groupby("scene").cumcount()
    recorders = [
        Recorder(_by_scene(run, rows, labels), run.cfg.realisations, beliefs)
        for labels, beliefs in selections
    ]

    def watch(*step: Any) -> bool:
        enough = [recorder(*step) for recorder in recorders]  # each of them sees every step
        return all(enough)

    # a run of another version must not start the training of this version's networks
    cfg = run.cfg.copy()
    same_version = _is_of(run.folder, cfg)
    cfg.auto = cfg.auto and same_version
    try:
        records = _rollout(cfg, run.scenes, kept, watch)
    except UserError as error:
        if same_version:
            raise
        raise UserError(f"{run.folder}: {_OTHER} ({error})") from error
    _check_same(
        run,
        pd.concat(records, ignore_index=True),
        [label for labels, _ in selections for label in labels],
    )
    return [
        [
            recorder.trace(str(row["scene"]), int(rows[label]), row)
            for label, row in zip(labels, _records(run, labels), strict=True)
        ]
        for recorder, (labels, _) in zip(recorders, selections, strict=True)
    ]


def _rollout(
    cfg: DictConfig, scenes: Sequence[Scene], kept: Sequence[int], watch: Watch
) -> list[pd.DataFrame]:
    """Run the episodes of some scenes, given by index."""
    evaluation = Evaluation(cfg)
    for need in evaluation.needs():
        build(need)
    observations = evaluation.observed.load(scenes)
    return rollout_scenes(
        cfg,
        [scenes[i] for i in kept],
        [observations[i] for i in kept],
        watch,
    )


def _by_scene(run: Run, rows: pd.Series, labels: Sequence[int]) -> dict[str, list[int]]:
    names = run.episodes.loc[list(labels), "scene"]
    return {str(scene): rows.loc[group.index].tolist() for scene, group in names.groupby(names)}


def _records(run: Run, labels: Sequence[int]) -> list[Mapping[str, Any]]:
    records = run.episodes.loc[list(labels)].to_dict("records")
    return [{**row, "row": int(label)} for label, row in zip(labels, records, strict=True)]  # type: ignore[dict-item]


def _check_same(run: Run, replayed: pd.DataFrame, labels: Sequence[int]) -> None:
    """Raise `UserError` unless the replayed episodes of `labels` equal the run's records."""
    keys = ["scene", "sound", "episode"]
    recorded = run.episodes.loc[sorted(set(labels))]
    again = recorded[keys].merge(replayed, on=keys, how="left")[list(recorded.columns)]
    try:
        pd.testing.assert_frame_equal(
            again, recorded.reset_index(drop=True), check_dtype=False, rtol=1e-9
        )
    except AssertionError as error:
        raise UserError(
            f"{run.folder}: the replayed episodes differ from episodes.csv: " + _OTHER
        ) from error
