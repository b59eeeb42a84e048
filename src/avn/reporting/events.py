"""TensorBoard events of runs and trainings, which share the table of the HPARAMS tab.

TensorBoard takes the columns of that table from one of the folders. All folders therefore declare
the same columns. It sorts them by name and shows the first five; the names of others begin with
`with_`, so that these are acoustics, agent, protocol, seed and sound.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

# Columns of settings, the most telling first, each with its type in the table.
SETTINGS: dict[str, type] = {
    "agent": str,
    "sound": str,
    "protocol": str,
    "acoustics": str,
    "split": str,
    "seed": float,
    "train_seed": float,
    "kind": str,
    "sounds_in_training": str,
    "sound_model": str,
    "mapper": str,
    "planner": str,
    "look": str,
    "localisation": str,
    "exploration": str,
    "episodes": str,
    "subset": str,
}
# Settings whose names would sort before `sound`.
_BEHIND = ("kind", "mapper", "planner", "look", "localisation", "exploration", "episodes")
# Columns of metrics: of runs, and the best value by which a training is judged.
METRICS = ("success", "spl", "softspl", "sna", "dtg", "sna_goal", "best_validation")


def write_summary(
    folder: Path,
    settings: Mapping[str, Any],
    metrics: Mapping[str, float],
    curves: Mapping[str, Mapping[int, float]],
    suffix: str = "",
) -> None:
    """Write the row of a run or training in the HPARAMS tab, its metrics and its curves.

    Parameters
    ----------
    folder : Path
        Folder of the events.
    settings : mapping
        Values of `SETTINGS`; those that do not apply are left out.
    metrics : mapping of str to float
        Values of `METRICS`, as far as there are any.
    curves : mapping of str to mapping of int to float
        Values by step of each tag.
    suffix : str
        Suffix of the file; an older file with it is replaced.
    """
    from torch.utils.tensorboard import SummaryWriter
    from torch.utils.tensorboard.summary import hparams

    if unknown := (set(settings) - set(SETTINGS)) | (set(metrics) - set(METRICS)):
        raise ValueError(f"not in the table of all runs: {', '.join(sorted(unknown))}")
    if suffix:
        for old in folder.glob(f"events.*{suffix}"):
            old.unlink()
    row = {
        f"with_{key}" if key in _BEHIND else key: kind(settings.get(key, kind()))
        for key, kind in SETTINGS.items()
    }
    with SummaryWriter(str(folder), filename_suffix=suffix) as writer:
        assert writer.file_writer is not None
        for summary in hparams(row, dict.fromkeys(METRICS)):
            writer.file_writer.add_summary(summary)
        for name, value in metrics.items():
            writer.add_scalar(name, value, 0)
        for name, values in curves.items():
            for step, value in values.items():
                writer.add_scalar(name, value, step)
