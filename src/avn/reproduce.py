"""`python -m avn.reproduce`: runs every row that exists and prints the table."""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
from hydra import compose
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from avn import evaluation, pipeline
from avn.cli import command
from avn.errors import UserError
from avn.reporting import results, table
from avn.stages import digest, tell

# Overrides that belong to this command and not to a row.
_OWN = ("rows", "seeds")


@command("reproduce")
def main(cfg: DictConfig) -> Path:
    """Make what is missing, run each row with each seed, and print the whole table."""
    if not cfg.rows or not cfg.seeds:
        raise UserError("rows, seeds: give at least one of each, such as rows=greedy seeds=0")
    parts = [part for part, found in pipeline.plans(cfg).items() if found]
    pipeline.scenes(cfg, parts, audible=True)
    shared = [o for o in HydraConfig.get().overrides.task if o.split("=")[0] not in _OWN]
    folders = []
    for row in cfg.rows:
        for seed in cfg.seeds:
            own = compose("eval", overrides=[*shared, f"agent={row}", f"seed={seed}"])
            folders.append(evaluation.evaluate(own))
    runs = pd.concat([pd.read_csv(folder / evaluation.RESULTS) for folder in folders])
    episodes = pd.concat([pd.read_csv(folder / evaluation.EPISODE_RECORDS) for folder in folders])
    table.print_tables(runs, episodes[episodes["agent"] == cfg.rows[0]])
    target = Path(cfg.outputs) / "reproduce" / digest([str(folder) for folder in folders])[:8]
    results.write_csv(runs, target / evaluation.RESULTS)
    results.write_csv(results.across_seeds(runs), target / "across_seeds.csv")
    tell(str(target))
    return target


if __name__ == "__main__":
    sys.exit(main())
