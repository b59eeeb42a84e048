"""List of the finished runs of a folder of outputs, read from their files.

Only YAML and CSV are read, so that a list of many runs takes little time: this module imports
neither torch nor pandas.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import yaml

from avn.acoustics.sound_names import joined_names
from avn.core.errors import UserError

# Columns, in order. `sort` and filters take them by these names.
COLUMNS = (
    *("agent", "sound", "protocol", "acoustics", "split", "subset", "episodes", "condition"),
    *("seed", "train_seed", "success", "spl", "date", "folder"),
)
NUMBERS = ("seed", "train_seed", "success", "spl")
FORMATS = ("table", "csv", "json")
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
# Names in the files that `avn.pipeline.run` writes; not imported, because that imports torch.
_CONFIG, _RESULTS, _AVERAGE, _ALL = "config.yaml", "results.csv", "average", "all"
# Newest column of the results; runs without it were made by an earlier version.
_NEWEST = "sna_goal"

Row = dict[str, Any]


def run_folders(outputs: Path) -> list[Path]:
    """Return the folders of the finished runs of a folder of outputs, in order.

    Raises
    ------
    UserError
        Where the folder does not exist.
    """
    if not outputs.is_dir():
        raise UserError(f"outputs: there is no folder {outputs}; give that of the runs")
    found = (outputs / "eval").glob(f"*/*/*/{_RESULTS}")
    return sorted(path.parent for path in found if (path.parent / _CONFIG).is_file())


def list_runs(outputs: Path) -> list[Row]:
    """Return a row with the `COLUMNS` for each finished run.

    Damaged runs, and those of earlier versions, whose rules may differ, have empty values.
    """
    return [_row(folder) for folder in run_folders(outputs)]


def check_columns(names: Iterable[str]) -> None:
    """Raise `UserError` for a name that is no column."""
    for name in names:
        if name not in COLUMNS:
            raise UserError(f"{name}: no column of the list; there are {', '.join(COLUMNS)}")


def select(rows: Iterable[Row], filters: Mapping[str, str]) -> list[Row]:
    """Return the rows whose columns have the given values.

    Parameters
    ----------
    rows : iterable of dict
        As `list_runs` gives them.
    filters : mapping of str to str
        Values by column; several with commas between them.
    """
    allowed = {key: value.split(",") for key, value in filters.items()}
    return [row for row in rows if all(_matches(row[key], own) for key, own in allowed.items())]


def order(rows: Iterable[Row], key: str) -> list[Row]:
    """Return rows sorted by a column, from high to low with a minus before its name."""
    column = key.removeprefix("-")
    known = [row for row in rows if row[column] not in (None, "")]
    unknown = [row for row in rows if row[column] in (None, "")]
    return [*sorted(known, key=lambda row: row[column], reverse=key != column), *unknown]


def as_csv(rows: Sequence[Row]) -> str:
    """Format rows as CSV with a heading."""
    lines = [",".join(COLUMNS)]
    lines += [",".join(map(_quoted, (row[key] for key in COLUMNS))) for row in rows]
    return "\n".join(lines)


def as_json(rows: Sequence[Row]) -> str:
    """Format rows as a JSON array of objects."""
    return json.dumps(list(rows), indent=1)


def _quoted(value: Any) -> str:
    text = "" if value is None else str(value)
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\n\r') else text


def _matches(value: Any, allowed: Sequence[str]) -> bool:
    if str(value) in allowed:
        return True
    try:
        return isinstance(value, int | float) and float(value) in map(float, allowed)
    except ValueError:
        return False


def read_config(folder: Path) -> dict[str, Any]:
    """Return the config of a run as plain values; empty where it is missing or damaged."""
    try:
        text = (folder / _CONFIG).read_text(encoding="utf-8")
        found = yaml.load(text, Loader=_LOADER)
    except (OSError, ValueError, yaml.YAMLError):
        return {}
    return found if isinstance(found, dict) else {}


def _row(folder: Path) -> Row:
    cfg = read_config(folder)
    row: Row = dict.fromkeys(COLUMNS, None) | _metrics(folder / _RESULTS)
    row |= {key: _name(cfg, key) for key in ("agent", "protocol", "acoustics", "split")}
    row |= {key: cfg.get(key) for key in ("subset", "episodes", "seed", "train_seed")}
    sounds = cfg.get("sound")
    row["sound"] = joined_names([*map(str, sounds)]) if isinstance(sounds, dict) else None
    try:
        row["condition"] = _condition(cfg) if cfg else None
    except (AttributeError, LookupError, TypeError, ValueError):  # damaged
        row["condition"] = None
    changed = datetime.fromtimestamp((folder / _RESULTS).stat().st_mtime, UTC)
    return row | {"date": changed.strftime("%Y-%m-%d %H:%M"), "folder": str(folder)}


def _condition(cfg: Mapping[str, Any]) -> str:
    """Return what is added to a still source in the quiet, such as `noise=white snr=10`."""
    nodes = {key: own for key, own in cfg.items() if isinstance(own, dict)}
    found = [
        f"{group}={nodes[group].get('name')}"
        for group in ("schedule", "distractor", "odometry", "motion")
        if nodes.get(group, {}).get("_target_")
    ]
    if nodes.get("distractor", {}).get("told"):
        found.append("told")
    heads = [own.get("head") for own in _acoustics(nodes)]
    if len(set(heads)) > 1:
        found.append(f"head={heads[0]}")
    microphone = nodes.get("microphone", {})
    if noises := microphone.get("noises"):
        ends = dict.fromkeys(f"{own:g}" for own in microphone.get("snr", ()))
        named = noises[0] if len(noises) == 1 else f"{len(noises)}-recordings"
        found.append(f"noise={named} snr={' to '.join(ends)}")
    if any(level := microphone.get("level", ())):
        found.append(f"level={level[0]:g} to {level[1]:g}")
    if microphone.get("gain", 1) != 1:
        found.append(f"gain={microphone['gain']:.3g}")
    return " ".join(found)


def _acoustics(nodes: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the settings of the acoustics of the test world and of the training world."""
    found = (nodes.get("acoustics"), nodes.get("training", {}).get("acoustics"))
    return [own for own in found if isinstance(own, dict)]


def _name(cfg: Mapping[str, Any], group: str) -> str | None:
    node = cfg.get(group)
    return str(node["name"]) if isinstance(node, dict) and "name" in node else None


def _metrics(path: Path) -> Row:
    """Return success rate and SPL over all scenes and sounds, from 0 to 1."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["scene"] == _AVERAGE]
        pooled = [row for row in rows if row["sound"] == _ALL] or rows
        if _NEWEST not in pooled[0]:
            return {}
        return {"success": float(pooled[0]["sr"]), "spl": float(pooled[0]["spl"])}
    except (OSError, ValueError, KeyError, IndexError, TypeError):
        return {}
