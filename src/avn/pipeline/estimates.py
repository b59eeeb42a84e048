"""Expected durations of stages, corrected by how long stages of the kind took on this machine."""

from __future__ import annotations

import json
import platform
from pathlib import Path
from typing import Any

from avn.core.files import atomic_write

SPEEDS = "speeds.json"
# Planned seconds from which a duration says something about the machine.
_LEAST = 5.0


def expected(outputs: str | Path, kind: str, planned: float) -> float:
    """Return the expected duration of a stage in seconds.

    Parameters
    ----------
    outputs : str or Path
        Folder of all outputs, which holds the recorded speeds.
    kind : str
        Kind of the stage.
    planned : float
        The stage's own estimate for a machine with two cores.
    """
    return planned * _of_this_machine(_read(outputs)).get(kind, 1.0)


def record(outputs: str | Path, kind: str, planned: float, took: float) -> None:
    """Record how long a stage took, for later estimates.

    Parameters
    ----------
    outputs : str or Path
        Folder of all outputs.
    kind : str
        Kind of the stage.
    planned : float
        The stage's own estimate; a short one is not recorded.
    took : float
        Duration of the whole stage in seconds.
    """
    if planned < _LEAST:
        return
    speeds = _read(outputs)
    speeds[platform.node()] = _of_this_machine(speeds) | {kind: round(took / planned, 3)}
    with atomic_write(Path(outputs) / SPEEDS) as part:
        part.write_text(json.dumps(speeds, indent=1, sort_keys=True) + "\n")


def _read(outputs: str | Path) -> dict[str, Any]:
    try:
        speeds = json.loads((Path(outputs) / SPEEDS).read_text())
    except (OSError, ValueError):  # estimates do without it
        return {}
    return speeds if isinstance(speeds, dict) else {}


def _of_this_machine(speeds: dict[str, Any]) -> dict[str, float]:
    own = speeds.get(platform.node())
    known = own.items() if isinstance(own, dict) else ()
    return {kind: ratio for kind, ratio in known if isinstance(ratio, float) and ratio > 0}
