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

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from avn.core.errors import UserError
from avn.reporting.world import trial_note

_RECORDS = "AVN_SWEEP_RECORDS"


def begin() -> None:
    """Create the folder of a sweep's records; processes of jobs inherit its path.

    Raises
    ------
    UserError
        Where there is no temporary folder.
    """
    try:
        os.environ[_RECORDS] = tempfile.mkdtemp(prefix="avn-sweep-")
    except OSError as error:
        raise UserError(
            f"TMPDIR: no temporary folder can be written to ({error.strerror}); set it to one"
        ) from error


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
    repeated = ("seed=", "train_seed=")
    record["setting"] = ", ".join(o for o in overrides if not o.startswith(repeated))
    record["train_seed"] = OmegaConf.select(cfg, "train_seed")
    try:
        folder = task(cfg)
        record["folder"] = str(folder) if folder else None
        record["outputs"] = str(cfg.outputs)
        record["note"] = trial_note((cfg.split.name, cfg.training.scenes.name))
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
    if any(record["folder"] for record in records):
        from avn.config.sweep_summary import summarise  # imports pandas

        summarise(records, tell_folder=not failed)
    for record in failed:
        print(f"{name}: failed: {record['overrides']}: {record['error']}", file=sys.stderr)
    if failed:
        print(f"{name}: {len(failed)} of {len(records)} jobs failed", file=sys.stderr)
    return max((record["code"] for record in failed), default=0)


def forget() -> None:
    """Remove the records of a sweep."""
    if folder := os.environ.pop(_RECORDS, None):
        shutil.rmtree(folder)
