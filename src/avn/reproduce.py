"""`python -m avn.reproduce`: runs every row that exists and prints the table."""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
from hydra import compose
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from avn import evaluation, listening, pipeline
from avn.cli import command
from avn.errors import UserError
from avn.reporting import results, table
from avn.stages import digest, stage_folder, tell

# Overrides that belong to this command and not to a row.
_OWN = ("rows", "seeds", "train_seeds")


@command("reproduce")
def main(cfg: DictConfig) -> Path:
    """Make what is missing, run each row with each seed, and print the whole table."""
    for key in _OWN:
        if not cfg[key]:
            raise UserError(f"{key}: empty; give at least one, such as rows=greedy seeds=0")
    parts = [part for part, found in pipeline.plans(cfg).items() if found]
    pipeline.scenes(cfg, parts, audible=True, asked=True)
    configs = [own for row in cfg.rows for own in _runs(cfg, row)]
    folders = [evaluation.evaluate(own) for own in configs]
    tables, episodes = zip(*map(evaluation.read, folders), strict=True)
    runs = pd.concat(tables)
    privileged = {own.agent.name for own in configs if own.agent.privileged}
    table.print_tables(runs, episodes[0], privileged=privileged)
    _compare(pd.concat(episodes), [own.agent.name for own in configs])
    target = stage_folder(cfg.outputs, "reproduce", "table", digest([f.name for f in folders]))
    results.write_csv(runs, target / evaluation.RESULTS)
    results.write_csv(results.across_seeds(runs), target / "across_seeds.csv")
    tell(str(target))
    return target


def _runs(cfg: DictConfig, row: str) -> list[DictConfig]:
    """The configs of a row: each seed, and each network where the row hears."""
    shared = [o for o in HydraConfig.get().overrides.task if o.split("=")[0] not in _OWN]
    runs = []
    for seed in cfg.seeds:
        first = compose("eval", overrides=[*shared, f"agent={row}", f"seed={seed}"])
        networks = cfg.train_seeds if listening.hears(first) else cfg.train_seeds[:1]
        for train_seed in networks:
            own = [f"agent={row}", f"seed={seed}", f"train_seed={train_seed}"]
            runs.append(compose("eval", overrides=[*shared, *own]))
    return runs


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
