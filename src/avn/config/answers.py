"""Records of finished commands, so that the same command is answered without building its stages.

A record is found by all that the answer can depend on: the composed config and the command line,
the files of the package, the sources of classes from outside, and the files that the config names.
It holds the folder of the product and the headings of its tables, and no result.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from avn.config import spare
from avn.core.files import atomic_write
from avn.core.hashing import digest, file_hash
from avn.core.sources import outside_sources

_PACKAGE = Path(__file__).parents[1]
# Keys whose value may be a folder of files that are read.
_FOLDERS = ("folder", "source")


@dataclass(frozen=True)
class Answer:
    """Product of a finished command.

    Attributes
    ----------
    folder : Path
        Folder of the product.
    shown : dict
        Plain values that are printed with it, by name.
    """

    folder: Path
    shown: dict[str, Any]


def recall(command: str, cfg: DictConfig, marker: str) -> Answer | None:
    """Return the product of a finished command, None where there is no record.

    Parameters
    ----------
    command : str
        Name of the command.
    cfg : DictConfig
        Composed config.
    marker : str
        File of the folder that marks the product as finished.
    """
    try:
        record = json.loads(_path(command, cfg).read_text())
        answer = Answer(Path(cfg.outputs) / record["folder"], dict(record["shown"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return answer if (answer.folder / marker).is_file() else None


def remember(command: str, cfg: DictConfig, folder: Path, shown: dict[str, Any]) -> None:
    """Record the product of a finished command.

    Parameters
    ----------
    command : str
        Name of the command.
    cfg : DictConfig
        Composed config.
    folder : Path
        Folder below `outputs`.
    shown : dict
        Plain values that are printed with it.
    """
    record = {"folder": folder.relative_to(cfg.outputs).as_posix(), "shown": shown}
    with suppress(OSError), atomic_write(_path(command, cfg)) as part:  # may be read-only
        part.write_text(json.dumps(record))


def _path(command: str, cfg: DictConfig) -> Path:
    settings: Any = OmegaConf.to_container(cfg, resolve=True)
    given = [*HydraConfig.get().overrides.task, *spare.settings()]
    fingerprint = digest(
        command, settings, given, _files(_PACKAGE), outside_sources(settings), _named(settings)
    )
    return Path(cfg.outputs) / ".answers" / f"{fingerprint[:32]}.json"


def _files(folder: Path) -> list[Any]:
    """Return path, size and time of change of all files below a folder, but for compiled ones."""
    found = []
    for path in sorted(folder.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            status = path.stat()
            found.append([path.as_posix(), status.st_size, status.st_mtime_ns])
    return found


def _named(settings: Any) -> list[Any]:
    """Return the content of the files, and the state of the folders, that a config names."""
    found: list[Any] = []
    for key, value in _strings("", settings):
        path = Path(value).expanduser()
        try:
            if path.is_file():
                found.append([value, file_hash(path)])
            elif key in _FOLDERS and path.is_dir():
                found.append([value, _files(path)])
        except (OSError, ValueError):  # too long, or no path at all
            continue
    return found


def _strings(key: str, node: Any) -> Iterator[tuple[str, str]]:
    """Yield the texts of a config, each with the last part of its key."""
    if isinstance(node, str):
        yield key, node
    for child, value in node.items() if isinstance(node, dict) else ():
        yield from _strings(str(child), value)
    for value in node if isinstance(node, list) else ():
        yield from _strings(key, value)
