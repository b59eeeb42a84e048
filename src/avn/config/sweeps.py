"""Sweeps: each job writes a record, and the end of the sweep summarises them.

Records are files, because a launcher may run its jobs in other processes.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from avn.core.files import stage_folder
from avn.core.hashing import digest
from avn.core.progress import log
from avn.reporting.results import AVERAGE, across_seeds, read_csv, write_csv

_RECORDS = "AVN_SWEEP_RECORDS"


def begin() -> None:
    """Create the folder of a sweep's records; processes of jobs inherit its path."""
    os.environ[_RECORDS] = tempfile.mkdtemp(prefix="avn-sweep-")


def run_job(
    task: Callable[[DictConfig], Path | None],
    cfg: DictConfig,
    explain: Callable[[BaseException], str | None],
) -> None:
    """Run one job of a sweep and record its result, so that a failure stops no other job.

    Parameters
    ----------
    task : callable
        Function of the config; gives the folder of its results.
    cfg : DictConfig
        Config of the job.
    explain : callable
        Function from an exception to a one-line message, None for an internal error.
    """
    job = HydraConfig.get().job
    overrides = list(HydraConfig.get().overrides.task)
    record: dict[str, Any] = {"overrides": ", ".join(overrides), "folder": None, "error": None}
    record["setting"] = ", ".join(o for o in overrides if not o.startswith("seed="))
    try:
        folder = task(cfg)
        record["folder"] = str(folder) if folder else None
        record["outputs"] = str(cfg.outputs)
    except Exception as error:
        line = explain(error)
        if line is None:
            traceback.print_exc()
        record["error"] = line or f"{type(error).__name__}: {error}"
        record["code"] = 1 if line is None else 2
        print(f"{record['overrides']}: {record['error']}", file=sys.stderr)
    (Path(os.environ[_RECORDS]) / f"{job.num:06d}.json").write_text(json.dumps(record))


def end(name: str) -> int:
    """Print mean and standard deviation of a sweep and the failed jobs; return the exit code."""
    folder = Path(os.environ[_RECORDS])
    records = [json.loads(path.read_text()) for path in sorted(folder.iterdir())]
    failed = [record for record in records if record["error"]]
    summary = _spread(records)
    if len(summary):
        _print(summary)
        outputs = Path(next(record["outputs"] for record in records if record["folder"]))
        done = [Path(r["folder"]).relative_to(outputs).as_posix() for r in records if r["folder"]]
        path = stage_folder(outputs, "eval", "sweeps/sweep", digest(done)) / "results.csv"
        write_csv(summary, path)
        if not failed:
            log(str(path.parent))
    for record in failed:
        print(f"{name}: failed: {record['overrides']}: {record['error']}", file=sys.stderr)
    if failed:
        print(f"{name}: {len(failed)} of {len(records)} jobs failed", file=sys.stderr)
    return max((record["code"] for record in failed), default=0)


def forget() -> None:
    """Remove the records of a sweep."""
    if folder := os.environ.pop(_RECORDS, None):
        shutil.rmtree(folder)


def _spread(records: list[dict[str, Any]]) -> pd.DataFrame:
    """Return mean and standard deviation over seeds, for each setting of the other keys."""
    tables: dict[str, list[pd.DataFrame]] = {}
    for record in records:
        path = Path(record["folder"] or "") / "results.csv"
        if record["folder"] and path.is_file():
            tables.setdefault(record["setting"], []).append(read_csv(path))
    spreads = [across_seeds(pd.concat(runs)).assign(setting=key) for key, runs in tables.items()]
    return pd.concat(spreads, ignore_index=True) if spreads else pd.DataFrame()


def _print(summary: pd.DataFrame) -> None:
    for row in summary[summary["scene"] == AVERAGE].to_dict("records"):
        metrics = ", ".join(
            f"{metric.upper()} {100 * row[metric]:.1f}"
            + (f" +- {100 * row[metric + '_std']:.1f} %" if row["seeds"] > 1 else " %")
            for metric in ("sr", "spl")
        )
        labels = f"{row['agent']}, {row['sound']} ({row['setting'] or 'defaults'})"
        log(f"{labels}, {row['seeds']} seeds: {metrics}")
