"""The page of some runs: one HTML file that holds all that it shows."""

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
from avn.pipeline.observed import Perceived, soundtrack
from avn.pipeline.replay import Run
from avn.reporting import page, page_media
from avn.reporting.results import across_seeds, summarise


def write_page(
    runs: Sequence[Run], count: int, show: str, paths: bool, output: Path | None
) -> Path:
    """Write the page of some runs; gives the file.

    Parameters
    ----------
    runs, count, show, paths
        As of `build`.
    output : Path, optional
        The file; by default one under the first run's `outputs/report`.

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
    """The page of some runs as HTML.

    Parameters
    ----------
    runs : sequence of Run
    count : int
        Episodes of each room and sound that are embedded with views and sound.
    show : str
        Which, one or more of typical, success and failure with commas; as
        `avn.pipeline.replay.choose`, of the first run, and the same ones of the others.
    paths : bool
        Whether the ways of all other episodes are embedded too.
    """
    names = replay.names_of(runs)
    groups = _seed_groups(runs)
    within = {index for group in groups for index in group}
    media = _Media()
    pages = []
    for index, (run, labels) in enumerate(zip(runs, _chosen(runs, count, show), strict=True)):
        if labels or paths:
            log(f"{run.folder}: walking {'all' if paths else len(labels)} episodes again")
        # the runs of several seeds taken together stand first
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
            )
        )
    together = [_together([runs[i] for i in own], [pages[i] for i in own]) for own in groups]
    agents = " · ".join(dict.fromkeys(str(run.cfg.agent.name) for run in runs))
    return page.render(
        f"Runs of {agents}",
        [*together, *pages],
        media.plans,
        media.views,
        media.with_twins(),
    )


def _seed_groups(runs: Sequence[Run]) -> list[list[int]]:
    """Numbers of the runs that differ in their seed alone, where there are two or more."""
    groups: dict[str, list[int]] = {}
    for index, run in enumerate(runs):
        groups.setdefault(replay.settings_but_seed(run), []).append(index)
    return [own for own in groups.values() if len(own) > 1]


def _together(runs: Sequence[Run], pages: Sequence[page.PageRun]) -> page.PageRun:
    """Runs that differ in their seed alone as one."""
    seeds = ", ".join(str(run.cfg.seed) for run in runs)
    episodes = pd.concat([own.episodes for own in pages], ignore_index=True)
    starts = np.cumsum([0, *(len(own.episodes) for own in pages)]).tolist()
    media = {
        start + label: number
        for start, own in zip(starts, pages, strict=False)
        for label, number in own.media.items()
    }
    return page.PageRun(
        name=f"{runs[0].cfg.agent.name}, seeds {seeds}",
        folder=", ".join(own.folder for own in pages),
        settings=pages[0].settings,
        privileged=pages[0].privileged,
        # with one seed for all, so that the intervals are over all episodes of a source
        results=summarise(episodes.assign(seed=0)),
        episodes=episodes,
        media=media,
        paths=[path for own in pages for path in own.paths or []] or None,
        seeds=across_seeds(pd.concat([own.results for own in pages])),
    )


def _chosen(runs: Sequence[Run], count: int, show: str) -> Iterator[list[int]]:
    """Rows of each run to embed: of each room and sound the same episodes where runs share them."""
    chosen: set[tuple[Any, ...]] = set()
    for run in runs:
        keys = dict(zip(run.episodes.index, replay.episode_keys(run.episodes), strict=True))
        labels: list[int] = []
        for _, part in run.episodes.groupby(["scene", "sound"], sort=False):
            shared = [int(label) for label in part.index if keys[label] in chosen]
            each = [replay.choose(part, word, count) for word in show.split(",")]
            labels += shared or list(dict.fromkeys(label for own in each for label in own))
        chosen |= {keys[label] for label in labels}
        yield labels


def _settings(run: Run) -> str:
    cfg = run.cfg
    parts = {key: cfg[key].name for key in ("protocol", "acoustics", "split", "mapper", "planner")}
    parts |= {
        key: cfg[key] for key in ("look", "exploration", "localisation", "subset", "episodes")
    }
    parts["train_seed"] = cfg.train_seed
    return ", ".join(f"{key}={value}" for key, value in parts.items())


class _Media:
    """Plans, views and episodes that are embedded, each once."""

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
        """Embed episodes of a run; gives the number of each, and all ways if asked for."""
        if not labels and not paths:
            return {}, None
        every = run.episodes.index.tolist() if paths else []
        traces, walked = replay.walk_again(run, [(labels, True), (every, False)])
        found = [{"plan": self._plan(own), "states": own.state.tolist()} for own in walked]
        return self._embed(run, index, labels, traces), found or None

    def _embed(
        self, run: Run, index: int, labels: Sequence[int], traces: Sequence[Trace]
    ) -> dict[int, int]:
        perceived = Perceived(run) if labels else None
        keys = replay.episode_keys(run.episodes.loc[list(labels)])
        numbers = {}
        for label, key, trace in zip(labels, keys, traces, strict=True):
            assert perceived is not None
            place = self._key(trace)
            clips = perceived.clips(trace)
            own = page_media.episode_media(trace, soundtrack(clips), clips.shape[-1])
            own |= {"run": index, "plan": self._plan(trace)}
            renderer = (place, str(run.cfg.renderer.name))
            own["views"] = [self._view(perceived, trace, *renderer, int(s)) for s in trace.state]
            numbers[int(label)] = len(self._episodes)
            self._episodes.append(own)
            self._keys.append((place, *key))
        return numbers

    @staticmethod
    def _key(trace: Trace) -> str:
        return str(getattr(trace.place, "folder", trace.place.name))

    def _plan(self, trace: Trace) -> int:
        """The number of an apartment's plan."""
        place = self._key(trace)
        if place not in self._plan_of:
            self._plan_of[place] = len(self.plans)
            self.plans.append(page_media.plan_of_place(trace.place))
        return self._plan_of[place]

    def _view(self, perceived: Perceived, trace: Trace, place: str, name: str, state: int) -> int:
        key = (place, name, state)
        if key not in self._view_of:
            self._view_of[key] = len(self.views)
            (view,) = perceived.views(trace.place.name, [state])
            self.views.append(page_media.view_url(view))
        return self._view_of[key]

    def with_twins(self) -> list[dict[str, Any]]:
        """The episodes, each with the numbers of those of all runs that are the same."""
        twins: dict[tuple[Any, ...], list[int]] = {}
        for number, key in enumerate(self._keys):
            twins.setdefault(key, []).append(number)
        return [
            {**own, "twins": twins[key]}
            for own, key in zip(self._episodes, self._keys, strict=True)
        ]
