"""Report of runs: a self-contained HTML file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from avn.core.errors import UserError
from avn.core.files import atomic_write, stage_folder
from avn.core.hashing import digest
from avn.core.progress import log
from avn.navigation.trace import Trace
from avn.pipeline import replay
from avn.pipeline.benchmark import changed_settings, describe_world, note_of, paper_sounds
from avn.pipeline.observed import RunObservations, soundtrack
from avn.pipeline.replay import Run
from avn.pipeline.run_names import names_of, settings_but_seed
from avn.reporting import page, page_media
from avn.reporting.results import across_runs


def write_page(
    runs: Sequence[Run], count: int, show: str, paths: bool, output: Path | None
) -> Path:
    """Write the report of some runs and return its path.

    Parameters
    ----------
    runs, count, show, paths
        As those of `build`.
    output : Path, optional
        Path of the file; by default under the first run's `outputs/report`.

    Raises
    ------
    UserError
        Where a run is given twice, or the file cannot be written.
    """
    if count < 0:
        raise UserError(f"--episodes: {count} is less than 0")
    folders = [run.folder.resolve() for run in runs]
    if len(set(folders)) < len(folders):
        raise UserError("RUN: a folder is given twice; name each run once")
    html = build(runs, count, show, paths)
    default = stage_folder(
        runs[0].cfg.outputs,
        "report",
        "report",
        digest([str(path) for path in folders], count, show, paths),
    )
    path = output or default.with_name(default.name + ".html")
    try:
        with atomic_write(path) as part:
            part.write_text(html, encoding="utf-8")
    except OSError as error:
        raise UserError(f"--output: {path}: {error.strerror}; choose another place") from error
    log(f"{len(html) / 1e6:.1f} MB")
    return path


def build(runs: Sequence[Run], count: int, show: str, paths: bool = False) -> str:
    """Return the report of some runs as HTML.

    Parameters
    ----------
    runs : sequence of Run
        Finished runs.
    count : int
        Number of episodes of each scene and sound that are embedded with views and sound.
    show : str
        One or more of typical, success and failure, separated by commas; see
        `avn.pipeline.replay.choose`. The selection is of the first run; other runs show the same
        episodes where they have them.
    paths : bool
        Whether the paths of all other episodes are embedded too.
    """
    names = names_of(runs)
    groups = _seed_groups(runs)
    within = {index for group in groups for index in group}
    media = _Media()
    pages = []
    for index, (run, labels) in enumerate(zip(runs, _chosen(runs, count, show), strict=True)):
        if labels or paths:
            log(f"{run.folder}: replaying {'all' if paths else len(labels)} episodes")
        # groups of runs over several seeds come first
        embedded, walked_paths = media.add(run, len(groups) + index, labels, paths)
        pages.append(
            page.PageRun(
                name=names[index],
                folder=str(run.folder),
                settings=_settings(run),
                privileged=bool(run.cfg.agent.privileged),
                results=run.results,
                episodes=run.episodes,
                media=embedded,
                paths=walked_paths,
                within=index in within,
                world=describe_world(run.cfg, run.default),
                paper=paper_sounds(run.cfg, run.default),
            )
        )
    together = [_together([runs[i] for i in group], [pages[i] for i in group]) for group in groups]
    agents = " · ".join(dict.fromkeys(str(run.cfg.agent.name) for run in runs))
    return page.render(
        f"Runs of {agents}",
        [*together, *pages],
        media.plans,
        media.views,
        media.with_twins(),
        note=next(filter(None, (note_of(run.cfg) for run in runs)), ""),
    )


def _seed_groups(runs: Sequence[Run]) -> list[list[int]]:
    """Return groups of indices of runs that differ in their seed only, of two runs or more."""
    groups: dict[str, list[int]] = {}
    for index, run in enumerate(runs):
        group = groups.setdefault(settings_but_seed(run), [])
        if run.cfg.seed not in [runs[other].cfg.seed for other in group]:  # a copy counts once
            group.append(index)
    return [group for group in groups.values() if len(group) > 1]


def _together(runs: Sequence[Run], pages: Sequence[page.PageRun]) -> page.PageRun:
    """Merge the pages of runs that differ in their seed only."""
    seeds = ", ".join(str(run.cfg.seed) for run in runs)
    episodes = pd.concat([one.episodes for one in pages], ignore_index=True)
    starts = np.cumsum([0, *(len(one.episodes) for one in pages)]).tolist()
    media = {
        start + label: number
        for start, one in zip(starts, pages, strict=False)
        for label, number in one.media.items()
    }
    return page.PageRun(
        name=f"{runs[0].cfg.agent.name}, seeds {seeds}",
        folder=", ".join(one.folder for one in pages),
        settings=pages[0].settings,
        privileged=pages[0].privileged,
        results=across_runs(episodes),
        episodes=episodes,
        media=media,
        paths=[path for one in pages for path in one.paths or []] or None,
        world=pages[0].world,
        paper=frozenset.intersection(*(frozenset(one.paper) for one in pages)),
    )


def _chosen(runs: Sequence[Run], count: int, show: str) -> Iterator[list[int]]:
    """Yield the rows of each run to embed; runs share episodes where they have the same ones."""
    chosen: set[tuple[Any, ...]] = set()
    for run in runs:
        keys = dict(zip(run.episodes.index, replay.episode_keys(run.episodes), strict=True))
        labels: list[int] = []
        for _, group in run.episodes.groupby(["scene", "sound"], sort=False):
            shared = [int(label) for label in group.index if keys[label] in chosen]
            picks = [replay.choose(group, word, count) for word in show.split(",")]
            labels += shared or list(dict.fromkeys(label for pick in picks for label in pick))
        chosen |= {keys[label] for label in labels}
        yield labels


def _settings(run: Run) -> str:
    """Describe the parts of a run's agent and what was changed in them, without its world."""
    read = {key.split(".")[0] for key in run.settings}
    parts = [group for group in ("sound_model", "mapper", "planner") if group in read]
    texts = [f"{group}={run.cfg[group].name}" for group in parts]
    changed = changed_settings(run.cfg, run.default)
    texts += [f"{key}={value}" for key, value in changed.items() if not key.endswith(".name")]
    seeds = {key.rsplit(".", 1)[-1] for key in run.settings}
    texts += [f"{key}={run.cfg[key]}" for key in ("seed", "train_seed") if key in seeds]
    return ", ".join(texts)


class _Media:
    """Plans, views and episodes of the report, each embedded once."""

    def __init__(self) -> None:
        self.plans: list[dict[str, Any]] = []
        self.views: list[str] = []
        self._episodes: list[dict[str, Any]] = []
        self._keys: list[tuple[Any, ...]] = []
        self._plan_of: dict[str, int] = {}
        self._view_of: dict[tuple[str, str, int], int] = {}

    def add(
        self, run: Run, index: int, labels: Sequence[int], paths: bool
    ) -> tuple[dict[int, int], list[dict[str, Any]] | None]:
        """Embed episodes of a run.

        Parameters
        ----------
        run : Run
            Finished run.
        index : int
            Number of the run on the page.
        labels : sequence of int
            Rows of `episodes.csv` to embed with views and sound.
        paths : bool
            Whether the paths of all episodes are wanted.

        Returns
        -------
        numbers : dict of int to int
            Number of each embedded episode by its row.
        shown_paths : list of dict or None
            Plan and states of all episodes, with `paths`.
        """
        if not labels and not paths:
            return {}, None
        others = run.episodes.index.tolist() if paths else []
        traces, path_traces = replay.rollout_again(run, [(labels, True), (others, False)])
        shown_paths = [
            {"plan": self._plan(one), "states": one.state.tolist()} for one in path_traces
        ]
        return self._embed(run, index, labels, traces), shown_paths or None

    def _embed(
        self, run: Run, index: int, labels: Sequence[int], traces: Sequence[Trace]
    ) -> dict[int, int]:
        observations = RunObservations(run) if labels else None
        keys = replay.episode_keys(run.episodes.loc[list(labels)])
        numbers = {}
        for label, key, trace in zip(labels, keys, traces, strict=True):
            assert observations is not None
            place = self._key(trace)
            clips = observations.clips(trace)
            episode = page_media.episode_media(trace, soundtrack(clips), clips.shape[-1])
            episode |= {"run": index, "plan": self._plan(trace)}
            shown = (place, str(run.cfg.renderer.name))
            episode["views"] = [
                self._view(observations, trace, *shown, int(s)) for s in trace.state
            ]
            numbers[int(label)] = len(self._episodes)
            self._episodes.append(episode)
            self._keys.append((place, *key))
        return numbers

    @staticmethod
    def _key(trace: Trace) -> str:
        return str(getattr(trace.scene, "folder", trace.scene.name))

    def _plan(self, trace: Trace) -> int:
        """Return the number of an apartment's plan; embed the plan where it is new."""
        place = self._key(trace)
        if place not in self._plan_of:
            self._plan_of[place] = len(self.plans)
            self.plans.append(page_media.scene_plan(trace.scene))
        return self._plan_of[place]

    def _view(
        self, observations: RunObservations, trace: Trace, place: str, name: str, state: int
    ) -> int:
        key = (place, name, state)
        if key not in self._view_of:
            self._view_of[key] = len(self.views)
            (view,) = observations.views(trace.scene.name, [state])
            self.views.append(page_media.view_url(view))
        return self._view_of[key]

    def with_twins(self) -> list[dict[str, Any]]:
        """Return the episodes, each with the numbers of the same episode in all runs."""
        twins: dict[tuple[Any, ...], list[int]] = {}
        for number, key in enumerate(self._keys):
            twins.setdefault(key, []).append(number)
        return [
            {**episode, "twins": twins[key]}
            for episode, key in zip(self._episodes, self._keys, strict=True)
        ]
