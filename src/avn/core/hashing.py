"""Fingerprints: SHA-256 of plain values, configs, dataclasses and files."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from functools import lru_cache
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, ListConfig, OmegaConf


def digest(*parts: Any) -> str:
    """Compute the SHA-256, in hex, of plain values, configs and dataclasses; keys are sorted."""
    return hashlib.sha256(canonical(parts).encode()).hexdigest()


def file_hash(path: Path) -> str:
    """Compute the SHA-256, in hex, of a file's bytes, cached by time of change and size."""
    status = path.stat()
    return _file_hash(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=64)
def _file_hash(path: Path, changed: int, size: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def canonical(value: Any) -> str:
    """Return the canonical JSON text of a value, on which `digest` is computed."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), default=_plain)


def _plain(value: Any) -> Any:
    if isinstance(value, DictConfig | ListConfig):
        return OmegaConf.to_container(value, resolve=True)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    if hasattr(value, "tobytes") and hasattr(value, "dtype"):  # an array; numpy is not imported
        return [str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    raise TypeError(f"cannot hash a {type(value).__name__}")
