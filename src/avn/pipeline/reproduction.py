"""Results table: evaluation of each row with each seed, and the table's files."""

from __future__ import annotations

import copy
import time
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import pandas as pd
from omegaconf import DictConfig

from avn.core.errors import UserError
from avn.core.files import atomic_write, stage_folder
from avn.core.hashing import digest
from avn.core.progress import format_duration, log
from avn.pipeline.benchmark import caption_of, paper_sounds_by_agent
from avn.pipeline.building import announce, discard_if_forced, make, missing, timings
from avn.pipeline.dashboard import Dashboard
from avn.pipeline.run import Evaluation, agent_label
from avn.pipeline.sounds import sound_files
from avn.reporting import comparison_table, published, results, table
from avn.reporting.comparison import INDEPENDENT, compare
from avn.reporting.finished_run import RESULTS, read_episodes, read_run
from avn.reporting.nesting import NETWORK
from avn.reporting.paper import paper_averages

# Files beside `results.csv`.
ACROSS, CELLS, TABLE, LATEX, SECONDS = (
    "across_seeds.csv",
    "cells.csv",
    "table.md",
    "table.tex",
    "seconds.csv",
)


def reproduce(cfg: DictConfig, rows: Sequence[DictConfig], defaults: Sequence[DictConfig]) -> Path:
    """Build what is missing, evaluate each row with each seed, and print the table.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.reproduce`.
    rows : sequence of DictConfig
        Config of each row, as of `avn.eval`.
    defaults : sequence of DictConfig
        Config of each row without changes; see `avn.config.defaults.default_config`.

    Returns
    -------
    Path
        Folder of the table.

    Raises
    ------
    UserError
        Where an option cannot work, or something is missing and `auto` is false.
    """
    configs = [config for row in rows for config in runs_of(cfg, row)]
    paper = paper_sounds_by_agent(rows, defaults)
    folders = make_runs(configs, [str(config.agent.name) for config in configs], paper)
    tables, episodes = zip(*map(read_run, folders), strict=True)
    networks = [config.train_seed for config in configs]
    runs, records = (with_networks(own, networks) for own in (tables, episodes))
    privileged = {agent_label(config) for config in configs if config.agent.privileged}
    cells = published.published(records, paper)
    caption = _caption(rows, defaults)
    table.print_table(published.terminal(cells, privileged), caption)
    if legend := published.legend(cells):
        table.wide_console().print(legend)
    table.print_table(table.hardness_table(episodes[0]), caption)
    sounds = list(sound_files(configs[0]))
    target = stage_folder(cfg.outputs, "reproduce", "table", digest([f.name for f in folders]))
    files = (
        (TABLE, published.markdown(cells, sounds, privileged, caption)),
        (LATEX, published.latex(cells, sounds, privileged, caption)),
    )
    _write(target, runs, records, cells, files)
    _compare(records)
    return target


def check_lists(cfg: DictConfig) -> None:
    """Raise `UserError` where there are no rows, seeds or networks."""
    for key in ("rows", "seeds", "train_seeds"):
        if not cfg[key]:
            raise UserError(f"{key}: empty; give at least one, such as rows=greedy seeds=0")


def settings_of(rows: Sequence[DictConfig]) -> set[str]:
    """Return the leaf keys of the config that a row or the command itself reads."""
    keys = {"rows", "conditions", "world", "sounds", "seeds", "train_seeds"}
    return keys.union(*(Evaluation(row).read() for row in rows))


def _caption(rows: Sequence[DictConfig], defaults: Sequence[DictConfig]) -> str:
    """Return the world of the rows, as the row that reads most settings has it."""
    pairs = list(zip(rows, defaults, strict=True))
    return caption_of(*max(pairs, key=lambda pair: len(Evaluation(pair[0]).read())))


def make_runs(
    configs: Sequence[DictConfig],
    names: Sequence[str],
    paper: Mapping[str, Collection[str]] = MappingProxyType({}),
) -> list[Path]:
    """Make all runs and what they need; print the plan first and each row when it is finished.

    Parameters
    ----------
    configs : sequence of DictConfig
        Config of each run, as of `avn.eval`.
    names : sequence of str
        Name of each run's row, for messages and the display; runs of one row follow each other.
    paper : mapping of str to collection of str
        Sounds by agent beside which the paper's results stand.

    Returns
    -------
    list of Path
        Folders of the runs.
    """
    runs = [Evaluation(cfg, name) for cfg, name in zip(configs, names, strict=True)]
    for run in runs:
        run.check()
    discard_if_forced(runs)
    steps = missing(runs)
    announce(steps, {run.fingerprint for run in runs})
    averages = {row: f"{sr:.1f} / {spl:.1f}" for row, (sr, spl) in paper_averages(paper).items()}
    rows = dict.fromkeys(names)
    with Dashboard([(s.title, s.expected()) for s in steps], list(rows), averages) as board:
        table = _Rows(runs, names, board)
        table.fill()
        for stage in steps:
            make(stage, explicit=isinstance(stage, Evaluation))
            board.made()
            table.fill()
    return [run.folder for run in runs]


class _Rows:
    """Rows of the table, filled in order as their runs finish."""

    def __init__(self, runs: Sequence[Evaluation], names: Sequence[str], board: Dashboard) -> None:
        self._left, self._board = list(zip(runs, names, strict=True)), board
        self._finished: dict[str, list[pd.Series]] = {}
        self._started = time.monotonic()

    def fill(self) -> None:
        """Add the next runs that are finished."""
        while self._left and self._left[0][0].done():
            run, row = self._left.pop(0)
            finished = self._finished.setdefault(row, [])
            finished.append(_averages(run.folder))
            mean = 100.0 * pd.DataFrame(finished).mean()
            average = f"{mean['sr']:.1f} / {mean['spl']:.1f}"
            self._board.fill(row, average)
            if row not in [left for _, left in self._left]:
                passed = format_duration(time.monotonic() - self._started)
                log(f"{row}: {average} after {passed}")


def _averages(folder: Path) -> pd.Series:
    """Return success rate and SPL of a run over all sounds and scenes."""
    pooled = read_episodes(folder).assign(sound=results.ALL_SOUNDS)
    run = results.summarise(pooled, draws=0)
    mean: pd.Series = run[run["scene"] == results.AVERAGE][["sr", "spl"]].mean()
    return mean


def runs_of(cfg: DictConfig, composed: DictConfig) -> list[DictConfig]:
    """Return the configs of a row: one per seed, and per train_seed where it has networks.

    Parameters
    ----------
    cfg : DictConfig
        Config of `avn.reproduce`.
    composed : DictConfig
        Config of the row.
    """
    networks = list(dict.fromkeys(cfg.train_seeds))
    if "train_seed" not in Evaluation(composed).read():
        networks = [composed.train_seed]
    runs = []
    for seed in dict.fromkeys(cfg.seeds):
        for train_seed in networks:
            config = copy.deepcopy(composed)  # composing anew is slow
            config.seed, config.train_seed = seed, train_seed
            runs.append(config)
    return runs


def with_networks(tables: Sequence[pd.DataFrame], networks: Sequence[int]) -> pd.DataFrame:
    """Join the tables of runs, with the network of each run as the last column.

    Parameters
    ----------
    tables : sequence of DataFrame
        A table of each run.
    networks : sequence of int
        `train_seed` of each run.
    """
    pairs = zip(tables, networks, strict=True)
    return pd.concat([own.assign(**{NETWORK: network}) for own, network in pairs])


def _write(
    target: Path,
    runs: pd.DataFrame,
    records: pd.DataFrame,
    cells: pd.DataFrame,
    files: Sequence[tuple[str, str]],
) -> None:
    """Write the table as CSV and as texts by file name, and the durations of the stages.

    Parameters
    ----------
    target : Path
        Folder of the table.
    runs, records : DataFrame
        Results and episodes of all runs.
    cells : DataFrame
        As `avn.reporting.published.published` returns it.
    files : sequence of (str, str)
        Names and texts of the other files.
    """
    results.write_csv(runs, target / RESULTS)
    results.write_csv(results.across_runs(records), target / ACROSS)
    results.write_csv(cells, target / CELLS)
    for name, text in files:
        with atomic_write(target / name) as part:
            part.write_text(text, encoding="utf-8")
    seconds = pd.DataFrame({"stage": list(timings), "seconds": list(timings.values())})
    if len(seconds):  # where nothing was made, the earlier durations stay
        seconds = seconds.sort_values("seconds", ascending=False)
        results.write_csv(seconds.round(1), target / SECONDS)
        for row in seconds.itertuples():
            log(f"{row.seconds:7.0f} s  {row.stage}")


def _compare(episodes: pd.DataFrame) -> None:
    """Print the difference of each row to the one before it, over the same episodes."""
    rows = list(dict.fromkeys(episodes["agent"]))
    for one, other in zip(rows[1:], rows, strict=False):
        first, second = (episodes[episodes["agent"] == row] for row in (one, other))
        log(comparison_table.line(compare(first, second, (one, other)), one, other))
    if len(rows) > 1:
        log(f"{INDEPENDENT}.")
