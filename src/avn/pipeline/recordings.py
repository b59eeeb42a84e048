"""Recordings of finished runs: what a run was made with stays what its films and reports play."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from omegaconf import DictConfig

from avn.acoustics.dry_sounds import content_hash, recording_bytes
from avn.acoustics.sound_table import packaged_sounds
from avn.core.errors import UserError
from avn.core.files import atomic_write
from avn.core.progress import log
from avn.pipeline.sounds import sound_files
from avn.reporting.results import write_csv

FILE = "recordings.csv"
COLUMNS = ("sound", "path", "sha256")


def keep_recordings(cfg: DictConfig, folder: Path) -> None:
    """Write `recordings.csv` of a run, and keep its recordings under `outputs/recordings`.

    Parameters
    ----------
    cfg : DictConfig
        Config of the run.
    folder : Path
        Folder of the run.
    """
    files = sound_files(cfg)
    hashes = content_hash(files)
    for name, path in files.items():
        kept = _kept(cfg, hashes[name])
        if path not in packaged_sounds() and not kept.is_file():
            with atomic_write(kept) as part:
                part.write_bytes(recording_bytes(path))
    rows = [(name, path, hashes[name]) for name, path in files.items()]
    write_csv(pd.DataFrame(rows, columns=list(COLUMNS)), folder / FILE)


def with_recordings(cfg: DictConfig, folder: Path) -> DictConfig:
    """Return the config of a finished run with the paths of the recordings that it was made with.

    Parameters
    ----------
    cfg : DictConfig
        Saved config of the run.
    folder : Path
        Folder of the run.

    Raises
    ------
    UserError
        Where a recording is neither kept nor still at its path.
    """
    rows = _read(folder)
    cfg = cfg.copy()
    cfg.sound = {name: _found(cfg, folder, *row) for name, row in rows.items()}
    return cfg


def has_recordings(folder: Path) -> bool:
    """Return whether a run has the file of its recordings, which earlier versions did not write."""
    return (folder / FILE).is_file()


def _read(folder: Path) -> dict[str, tuple[str, str]]:
    try:
        table = pd.read_csv(folder / FILE, dtype=str, keep_default_na=False)
        rows = table[list(COLUMNS)].itertuples(index=False)
        return {str(name): (str(path), str(known)) for name, path, known in rows}
    except (OSError, ValueError, KeyError) as error:
        raise UserError(
            f"{folder / FILE}: damaged; delete the folder of the run and run avn.eval again"
        ) from error


def _found(cfg: DictConfig, folder: Path, path: str, known: str) -> str:
    """Return the path of a recording of known content: the kept one, or that of the run."""
    is_same = _hash(path) == known
    if path in packaged_sounds() and is_same:
        return path
    kept = _kept(cfg, known)
    if kept.is_file() and _hash(str(kept)) == known:
        if not is_same:
            log(f"{folder}: {path} is not there or has changed since the run, whose copy is used")
        return str(kept)
    if is_same:
        return path
    raise UserError(
        f"{folder}: the recording {path} is not the one of the run, and {kept} is missing; put it "
        "back, or run avn.eval again"
    )


def _hash(path: str) -> str | None:
    try:
        return content_hash({path: path})[path]
    except UserError:
        return None


def _kept(cfg: DictConfig, known: str) -> Path:
    return Path(cfg.outputs) / "recordings" / known[:16]
