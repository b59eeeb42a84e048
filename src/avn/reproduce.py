"""`python -m avn.reproduce`: runs every row that exists and prints the table."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from hydra import compose
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from avn import evaluation, listening, pipeline, reinforcement, sound_features
from avn.cli import command
from avn.errors import UserError
from avn.reporting import published, results, table
from avn.stages import digest, spent, stage_folder, tell, written_whole

# Overrides that belong to this command and not to a row.
_OWN = ("rows", "seeds", "train_seeds", "sounds")
# What it leaves beside `results.csv`.
ACROSS, CELLS, TABLE, LATEX, SECONDS = (
    "across_seeds.csv",
    "cells.csv",
    "table.md",
    "table.tex",
    "seconds.csv",
)


@command("reproduce")
def main(cfg: DictConfig) -> Path:
    """Make what is missing, run each row with each seed, and print the whole table."""
    for key in ("rows", "seeds", "train_seeds"):
        if not cfg[key]:
            raise UserError(f"{key}: empty; give at least one, such as rows=greedy seeds=0")
    started = time.perf_counter()
    parts = [part for part, found in pipeline.plans(cfg).items() if found]
    pipeline.scenes(cfg, parts, audible=True, asked=True)
    configs = [own for row in cfg.rows for own in _runs(cfg, row)]
    _listen_once(configs)
    folders = []
    for number, own in enumerate(configs):
        folders.append(evaluation.evaluate(own))
        if number + 1 == len(configs) or configs[number + 1].agent.name != own.agent.name:
            _tell_row(own.agent.name, folders, configs, time.perf_counter() - started)
    tables, episodes = zip(*map(evaluation.read, folders), strict=True)
    runs, walked = pd.concat(tables), pd.concat(episodes)
    privileged = {own.agent.name for own in configs if own.agent.privileged}
    table.print_tables(runs, episodes[0], privileged=privileged)
    _compare(walked, [own.agent.name for own in configs])
    target = stage_folder(cfg.outputs, "reproduce", "table", digest([f.name for f in folders]))
    _write(target, runs, walked, list(listening.sound_files(configs[0])))
    tell(str(target))
    return target


def _listen_once(configs: Sequence[DictConfig]) -> None:
    """Make the features of what is heard before any row asks for estimates alone.

    The estimates come with the features, so that every clip is listened to once.
    """
    for own in configs:
        missing = not evaluation.finished(own)
        if missing and "sound_feature" in evaluation.wanted_by(own) and listening.hears(own):
            rooms = pipeline.scenes(own, (own.part,), audible=True)[own.part]
            sound_features.sound_features(own, rooms, sound_features.evaluated_clips(own))


def _runs(cfg: DictConfig, row: str) -> list[DictConfig]:
    """The configs of a row: each seed, and each network where something in it is trained."""
    shared = [o for o in HydraConfig.get().overrides.task if o.split("=")[0] not in _OWN]
    runs = []
    for seed in cfg.seeds:
        first = _composed([*shared, f"agent={row}", f"seed={seed}"], cfg.sounds)
        trained = listening.hears(first) or reinforcement.learns(first)
        networks = cfg.train_seeds if trained else cfg.train_seeds[:1]
        for train_seed in networks:
            own = [f"agent={row}", f"seed={seed}", f"train_seed={train_seed}"]
            runs.append(_composed([*shared, *own], cfg.sounds))
    return runs


def _composed(overrides: list[str], sounds: Sequence[str]) -> DictConfig:
    """The config of one run, with some of its sounds where any are named."""
    own = compose("eval", overrides=overrides)
    for name in sounds:
        if name not in own.sound:
            raise UserError(f"sounds: '{name}' is none of {', '.join(own.sound)}")
    if sounds:
        own.sound = {name: own.sound[name] for name in sounds}
    return own


def _tell_row(name: str, folders: list[Path], configs: list[DictConfig], seconds: float) -> None:
    """Print the average of a row as soon as it has walked."""
    own = [f for f, cfg in zip(folders, configs, strict=False) if cfg.agent.name == name]
    runs = pd.concat([evaluation.read(folder)[0] for folder in own])
    average = runs[runs["room"] == results.AVERAGE]
    every = average[average["sound"] == results.ALL_SOUNDS]
    mean = 100.0 * (every if len(every) else average)[["sr", "spl"]].mean()
    tell(f"{name}: {mean['sr']:.1f} / {mean['spl']:.1f} after {seconds / 60:.1f} min")


def _write(target: Path, runs: pd.DataFrame, walked: pd.DataFrame, sounds: list[str]) -> None:
    """Leave the table as CSV, Markdown and LaTeX, and where the time went."""
    cells = published.published(runs, walked)
    results.write_csv(runs, target / evaluation.RESULTS)
    results.write_csv(results.across_seeds(runs), target / ACROSS)
    results.write_csv(cells, target / CELLS)
    for name, text in (
        (TABLE, published.markdown(cells, sounds)),
        (LATEX, published.latex(cells, sounds)),
    ):
        with written_whole(target / name) as part:
            part.write_text(text, encoding="utf-8")
    seconds = pd.DataFrame({"stage": list(spent), "seconds": list(spent.values())})
    if len(seconds):  # a table that was all there already says nothing new
        seconds = seconds.sort_values("seconds", ascending=False).round(1)
        results.write_csv(seconds, target / SECONDS)
        for row in seconds.itertuples():
            tell(f"{row.seconds:7.0f} s  {row.stage}")


def _compare(episodes: pd.DataFrame, names: list[str]) -> None:
    """Print how much better each row is than the one before it, over the same episodes."""
    rows = list(dict.fromkeys(names))
    figures = [*results.FIGURES.values()]
    keys = ["agent", "sound", "room", "seed", "episode", "source", "start_cell", "start_heading"]
    mean = episodes.groupby(keys, as_index=False)[figures].mean()  # over networks
    for one, other in zip(rows[1:], rows, strict=False):
        differences = results.compare(mean[mean["agent"] == one], mean[mean["agent"] == other])
        spl = differences.set_index("figure").loc["spl"] * 100
        tell(
            f"{one} less {other}: SPL {spl['difference']:+.1f} points "
            f"(95 % interval {spl['low']:+.1f} to {spl['high']:+.1f})"
        )


if __name__ == "__main__":
    sys.exit(main())
